# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The types of ``control_msgs``, of which there is no wheel: built by those of rosidl and a compiler.

Fields and names are those that the action has on every distribution, so that the drive and any
client of it talk over DDS as with an installed ROS.

"""

import hashlib
import os
import shutil
import sys
import sysconfig
import tempfile
from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
from processes import run_process

PACKAGE = 'control_msgs'
FIELDS = ('position', 'velocity', 'acceleration')
POINTS = '\n'.join(
    f'trajectory_msgs/JointTrajectoryPoint {x}' for x in ('desired', 'actual', 'error')
)
DEFINITIONS = {
    'msg/JointTolerance.msg': '\n'.join(['string name', *(f'float64 {each}' for each in FIELDS)]),
    'action/FollowJointTrajectory.action': f"""\
trajectory_msgs/JointTrajectory trajectory
JointTolerance[] path_tolerance
JointTolerance[] goal_tolerance
builtin_interfaces/Duration goal_time_tolerance
---
int32 error_code
int32 SUCCESSFUL = 0
int32 INVALID_GOAL = -1
int32 INVALID_JOINTS = -2
int32 OLD_HEADER_TIMESTAMP = -3
int32 PATH_TOLERANCE_VIOLATED = -4
int32 GOAL_TOLERANCE_VIOLATED = -5
string error_string
---
std_msgs/Header header
string[] joint_names
{POINTS}
""",
}
USED = (
    'trajectory_msgs',
    'geometry_msgs',
    'std_msgs',
    'builtin_interfaces',
    'action_msgs',
    'service_msgs',
    'unique_identifier_msgs',
)
SUPPORTS = ('rosidl_typesupport_fastrtps_c', 'rosidl_typesupport_introspection_c')
PREFIX = Path(sys.prefix)
TESTS = str(Path(__file__).parents[1])


def why_not() -> str:
    """Say why the types cannot be had, if they cannot."""
    if find_spec(PACKAGE) is None:
        headers = Path(sysconfig.get_path('include'), 'Python.h')
        if not shutil.which('g++') or not headers.is_file():
            return f'{PACKAGE} has no wheel; to build it, g++ and {headers} are needed'
    return ''


def import_folder(cache: Path) -> Path:
    """Return the folder from which the types can be imported; a build is kept when it is whole."""
    folder = cache / hashlib.sha256(repr((DEFINITIONS, sys.version, PREFIX)).encode()).hexdigest()
    if not folder.exists():
        building = Path(tempfile.mkdtemp(dir=cache))
        build(building)
        try:
            building.rename(folder)
        except OSError:  # another run was faster
            shutil.rmtree(building)
    return folder / 'py'


def build(folder: Path) -> None:
    """Generate the sources of the package, compile and link them."""
    run_process(
        [sys.executable, __file__, str(folder)],
        env={**os.environ, 'AMENT_PREFIX_PATH': str(PREFIX), 'PYTHONPATH': TESTS},
        check=True,
    )
    headers = [PREFIX / 'include', *(PREFIX / 'include').iterdir(), *folder.iterdir()]
    headers += map(Path, (sysconfig.get_path('include'), np.get_include()))
    options = ['-O0', '-w', '-fPIC', *(f'-I{each}' for each in headers)]
    objects = []
    for source in sorted([*folder.rglob('*.c'), *folder.rglob('*.cpp')]):
        objects.append(source.with_suffix('.o'))
        run('gcc' if source.suffix == '.c' else 'g++', *options, '-c', source, '-o', objects[-1])
    root, libraries = folder / 'py' / PACKAGE, PREFIX / 'lib'
    entry = [each for each in objects if '.ep.' in each.name]
    others = [each for each in objects if each not in entry]
    needed = [each for name in USED for each in libraries.glob(f'lib{name}__*_*.so')]
    needed += [*libraries.glob('librosidl_*.so'), *libraries.glob('libfastcdr.so.?')]
    needed += [libraries / 'librmw.so', libraries / 'librcutils.so']
    # rosidl asks for a library of this name for each support; what one holds may come of another.
    first, second = (root / f'lib{PACKAGE}__{support}.so' for support in SUPPORTS)
    rest = f'-Wl,-rpath,{libraries}:$ORIGIN', '-Wl,--no-as-needed,--allow-shlib-undefined'
    run('g++', '-shared', *rest, f'-Wl,-soname={first.name}', '-o', first, *others, *needed)
    run('g++', '-shared', *rest, f'-Wl,-soname={second.name}', '-o', second, first)
    module = root / f'{PACKAGE}_s__rosidl_typesupport_c.so'
    run('g++', '-shared', *rest, '-o', module, *entry, first, second)
    (root / '__init__.py').touch()


def run(*words: object) -> None:
    """Run a command, and show what it says if it fails."""
    run_process(words, check=True)


def generators() -> Iterator[tuple[str, Any]]:
    """Give what rosidl makes, and what makes it."""
    from rosidl_generator_c.cli import GenerateC  # noqa: PLC0415 - after AMENT_PREFIX_PATH
    from rosidl_generator_py.cli import GeneratePython  # noqa: PLC0415
    from rosidl_typesupport_c.cli import GenerateCTypesupport  # noqa: PLC0415
    from rosidl_typesupport_fastrtps_c.cli import GenerateFastRTPSCTypesupport  # noqa: PLC0415
    from rosidl_typesupport_introspection_c.cli import (  # noqa: PLC0415
        GenerateIntrospectionCTypesupport,
    )

    yield 'c', GenerateC('c')
    yield 'support', GenerateCTypesupport('support', typesupport_implementations=[*SUPPORTS])
    yield 'fastrtps', GenerateFastRTPSCTypesupport('fastrtps')
    yield 'introspection', GenerateIntrospectionCTypesupport('introspection')
    python = GeneratePython('py', typesupport_implementations=['rosidl_typesupport_c'])
    yield 'py', python


def generate(folder: Path) -> None:
    """Write the sources of the package, in a process of its own, which has the wheels' paths."""
    from rosidl_adapter import convert_to_idl  # noqa: PLC0415
    from rosidl_generator_type_description.cli import HashTypeDescription  # noqa: PLC0415

    for name, text in DEFINITIONS.items():
        source = folder / 'definitions' / name
        source.parent.mkdir(parents=True)
        source.write_text(text, encoding='utf-8')
        convert_to_idl(folder / 'definitions', PACKAGE, Path(name), folder / 'idl' / PACKAGE)
    idl = folder / 'idl' / PACKAGE
    common = {
        'package_name': PACKAGE,
        'interface_files': [f'{idl}:{Path(name).with_suffix(".idl")}' for name in DEFINITIONS],
        'include_paths': [str(PREFIX / 'share'), str(folder / 'idl')],
    }
    hashes = folder / 'hashes' / PACKAGE
    hashes.mkdir(parents=True)
    described = HashTypeDescription('hashes').generate_type_hashes(**common, output_path=hashes)
    for name, generator in generators():
        output = folder / name / PACKAGE
        output.mkdir(parents=True)
        more = {'type_description_files': described} if name == 'c' else {}
        generator.generate(**common, output_path=output, **more)


if __name__ == '__main__':
    generate(Path(sys.argv[1]))
