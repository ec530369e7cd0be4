# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Build the wheel with its kernels, install it into an empty environment and use it: `make wheel`.

It is built from the source distribution, which holds what the repository holds; both land in
dist/. What it requires comes from the lock that is named; nothing is taken from the folder of the
project. Each supported Python of this machine compiles the entry points that the wheel brings.

Users have no lock: the oldest and the newest of these Pythons also take the wheel with the newest
of all that it requires, and run the tests in TRIED with it: every public name and every verb once,
and the examples of README. A robot, without the laboratory, drives, records and replays.

"""

import json
import os
import shutil
import signal
import subprocess
import sys
import tarfile
import tempfile
import time
import urllib.request
import zipfile
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from itertools import chain
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

from stickslip_ros.sources import sources_digest  # noqa: E402 - this tree's, not an installed one

DIST = ROOT / 'dist'
BIN = Path(sys.executable).parent
KERNELS = f'stickslip_ros/kernels/stickslip_ros-{sources_digest()}'
PORTABLE = {  # what stickslip_ros/kernels/cache.py looks for
    'NUMBA_CPU_NAME': 'x86-64-v3',
    'NUMBA_CPU_FEATURES': '',
}
PYTHONS = '3.10', '3.11', '3.12', '3.13', '3.14'
SHIPPED = (
    'stickslip_ros/py.typed',
    'stickslip_ros/lab/figures/page.css',
    'stickslip_ros/lab/panel/page/panel.js',
    'stickslip_ros/lab/validation/foreign.csv',
    'stickslip_ros/lab/validation/references.csv',
    'share/stickslip_ros/package.xml',
    'share/stickslip_ros/config/test_stand.yaml',
    'share/stickslip_ros/config/stages/clamp.yaml',
    'share/stickslip_ros/launch/drive.launch.py',
    'share/ament_index/resource_index/packages/stickslip_ros',
    'lib/stickslip_ros/drive',
)
REALISTIC = 'share/stickslip_ros/config/realistic.yaml'
WITHOUT_ROS = (
    'stickslip contact --normal-force 0.7',
    f'stickslip simulate --params {REALISTIC} --voltage 100 --steps 20 -o run.mcap',
    'stickslip simulate --stage clamp --voltage 100 --steps 5',
    'stickslip info run.mcap',
    'stickslip export run.mcap -o run.csv',
    'stickslip compare run.csv run.mcap',
    'stickslip simulate --voltage 100 --steps 20 -o ideal.mcap',
    'stickslip fit ideal.mcap --free contact.friction --starts 1',
    'stickslip compare experiment.csv model',
    'stickslip import experiment.csv -o clean.csv',
    'stickslip compare clean.csv experiment.csv',
    'drive --help',
)
REFUSED = 'drive', 'stickslip demo', 'stickslip panel', 'stickslip command voltage 10V'
WITH_ROS = '../lib/stickslip_ros/drive --help', 'stickslip demo -o demo'
OF_A_ROBOT = 'python robot.py', 'stickslip info drive.mcap', 'stickslip replay drive.mcap'
LAB = {'matplotlib', 'pandas', 'rich', 'scipy'}
EXTRAS = 'design,formats,jazzy,lab,panel,parquet,units'
TRIED = 'test/test_public_calls.py', 'test/test_public.py', 'test/lab/readers'
"""Tests of the public names, of what a notebook shows of them, of verbs and of tables."""
SHOWN = 'numpy==', 'numba==', 'pandas==', 'scipy==', 'matplotlib==', 'pyarrow=='
OF_THE_SOURCE = 'test/test_public.py::test_types_and_documentation_name_what_is_public'
FOREIGN = 'LD_LIBRARY_PATH', '_ROS_WHEELS_BOOTSTRAP_COMPLETE', 'PYTHONPATH', 'NUMBA_CACHE_DIR'
"""What another environment may have set: this one sets its own."""


def main() -> None:
    """Build, install, use."""
    lock = Path(sys.argv[1]).resolve()
    shutil.rmtree(DIST, ignore_errors=True)
    with tempfile.TemporaryDirectory(prefix='stickslip_wheel_') as name:
        folder = Path(name)
        plain = built(folder)
        pythons = [path for path in map(python_of, PYTHONS) if path]
        with ThreadPoolExecutor(2) as threads:
            kernels = [*threads.map(lambda each: compiled_by(each, plain, lock, folder), pythons)]
        wheel = with_kernels(plain, kernels, folder)
        run(BIN / 'twine', 'check', '--strict', *DIST.iterdir())
        environment = folder / 'venv'
        install(environment, f'{wheel}[lab,panel]', *locked(lock), python=sys.executable)
        use_without_ros(environment)
        install(environment, f'{wheel}[{lock.stem}]', *locked(lock))
        for words in WITH_ROS:
            said(words, environment)
        tests = unpacked_tests(folder)
        use_as_a_robot(wheel, lock, tests, folder / 'robot')
        with ThreadPoolExecutor(2) as threads:
            ends = dict.fromkeys((pythons[0], pythons[-1]))
            [*threads.map(lambda each: try_newest(each, wheel, tests, folder), ends)]
    print(f'{wheel.relative_to(ROOT)}: installs and runs; kernels for {len(pythons)} Pythons')


def built(folder: Path) -> Path:
    """Build the wheel from the source distribution; refuse one that lacks a file."""
    run(sys.executable, 'setup.py', '--quiet', 'sdist', '--dist-dir', DIST, cwd=ROOT)
    [source] = DIST.glob('*.tar.gz')
    top = source.name.removesuffix('.tar.gz')
    with tarfile.open(source) as archive:
        packed = {name.removeprefix(f'{top}/') for name in archive.getnames()}
    if (ROOT / '.git').exists():
        git = subprocess.run(['git', 'ls-files'], cwd=ROOT, check=True, stdout=subprocess.PIPE)
        if lacking := {*git.stdout.decode().splitlines()} - packed:
            sys.exit(f'{source.name} lacks {", ".join(sorted(lacking))}; look at MANIFEST.in')
    options = '--quiet', '--no-deps', '--no-build-isolation', '--wheel-dir', folder
    run(sys.executable, '-m', 'pip', 'wheel', *options, source)
    [wheel] = folder.glob(f'{top}-*.whl')
    with zipfile.ZipFile(wheel) as archive:
        names = archive.namelist()
    lacking = {file for file in SHIPPED if not any(name.endswith(file) for name in names)}
    if lacking:
        sys.exit(f'{wheel.name} lacks {", ".join(sorted(lacking))}; look at setup.py')
    return wheel


def python_of(version: str) -> str | None:
    """Return an interpreter of a version; None if none starts on this machine."""
    places = (Path.home() / '.pyenv' / 'versions').glob(f'{version}.*/bin/python')
    for path in (f'python{version}', *map(str, places)):
        with suppress(OSError):
            if subprocess.run([path, '-c', ''], capture_output=True, check=False).returncode == 0:
                return path
    return None


def compiled_by(python: str, wheel: Path, lock: Path, folder: Path) -> list[Path]:
    """Compile the entry points by an interpreter, for PORTABLE processors; return their files."""
    environment = folder / f'compiler_{Path(python).parts[-3:][0]}'
    install(environment, wheel, *locked(lock), python=python)
    said(
        'stickslip compile',
        environment,
        variables=PORTABLE | {'NUMBA_CACHE_DIR': str(environment)},
    )
    return sorted((environment / Path(KERNELS).name).glob('*-entry-*.nbc'))


def with_kernels(plain: Path, kernels: list[list[Path]], folder: Path) -> Path:
    """Pack a wheel anew, into dist/, with the machine code of every Python."""
    run(sys.executable, '-m', 'wheel', 'unpack', '--dest', folder / 'unpacked', plain)
    [tree] = (folder / 'unpacked').iterdir()
    (tree / KERNELS).mkdir()
    for file in chain.from_iterable(kernels):
        shutil.copy(file, tree / KERNELS)
    run(sys.executable, '-m', 'wheel', 'pack', '--dest-dir', DIST, tree)
    [wheel] = DIST.glob('*.whl')
    return wheel


def install(environment: Path, *what: object, python: str = '') -> None:
    """Install by uv, into a new environment if a Python is named."""
    if python:
        run(python, '-m', 'venv', '--without-pip', environment)
    there = '--python', environment / 'bin' / 'python', '--system-certs', '--quiet'
    run(BIN / 'uv', 'pip', 'install', *there, *what)


def locked(lock: Path) -> tuple[object, ...]:
    """Return the options that take versions and hashes from a lock, build tools included."""
    return '-c', lock, '-r', lock.with_name('build.txt'), '--no-build-isolation'


def unpacked_tests(folder: Path) -> Path:
    """Unpack the source distribution without the package, so that tests find the installed one."""
    [source] = DIST.glob('*.tar.gz')
    with tarfile.open(source) as archive:
        archive.extractall(folder)
    tree = folder / source.name.removesuffix('.tar.gz')
    shutil.rmtree(tree / 'stickslip_ros')
    return tree


def try_newest(python: str, wheel: Path, tests: Path, folder: Path) -> None:
    """Run tests with the newest of all that the wheel requires; a warning of it is no failure."""
    environment = folder / f'newest_{Path(python).parts[-3:][0]}'
    testing = 'pytest', 'pytest-timeout', 'hypothesis', 'setuptools<80'
    install(environment, f'{wheel}[{EXTRAS}]', *testing, python=python)
    options = '-W', 'default', '-p', 'no:cacheprovider', '--deselect', OF_THE_SOURCE
    start_s = time.monotonic()
    done = subprocess.run(
        [environment / 'bin' / 'python', '-m', 'pytest', *options, *TRIED],
        cwd=tests,
        env=surroundings(),
        capture_output=True,
        text=True,
        check=False,
    )
    freeze = BIN / 'uv', 'pip', 'freeze', '--python', environment / 'bin' / 'python', '--quiet'
    versions = subprocess.run(
        [*map(str, freeze)], env=surroundings(), capture_output=True, text=True, check=True
    )
    shown = [each for each in versions.stdout.split() if each.startswith(SHOWN)]
    print(f'newest of all by {python}: {", ".join(shown)}', flush=True)
    if done.returncode:
        sys.exit(f'{done.stdout}{done.stderr}')
    print(f'  tests passed: {time.monotonic() - start_s:.1f} s', flush=True)


def use_without_ros(environment: Path) -> None:
    """Do what needs no ROS, with the kernels of the wheel; the same bytes come without them."""
    page = (ROOT / 'docs' / 'howto' / 'compare.md').read_text(encoding='utf-8')
    example = page.partition('```csv\n')[2].partition('```')[0]
    (environment / 'experiment.csv').write_text(example, encoding='utf-8')
    for words in WITHOUT_ROS:
        said(words, environment)
    for words in REFUSED:
        said(words, environment, code=2)
    show_in_browser(environment)
    if compiled := json.loads(said('stickslip compile --json', environment))['kernels']:
        sys.exit(f'{compiled} kernels are compiled that the wheel should bring')
    [brought] = environment.glob(f'lib/python*/site-packages/{KERNELS}')
    shutil.rmtree(brought)
    said('stickslip replay run.mcap', environment)  # fails if a byte differs


def use_as_a_robot(wheel: Path, lock: Path, tests: Path, environment: Path) -> None:
    """Drive, record and replay without the laboratory, which must not be there."""
    install(environment, wheel, *locked(lock), python=sys.executable)  # what empy is built with
    install(environment, f'{wheel}[{lock.stem}]', *locked(lock))
    found = {path.name for path in environment.glob('lib/python*/site-packages/*')}
    if LAB & found:
        sys.exit(f'a robot gets {", ".join(sorted(LAB & found))}; look at setup.py')
    shutil.copy(tests / 'test' / 'robot.py', environment)
    for words in OF_A_ROBOT:
        said(words, environment)
    said('stickslip fit drive.mcap --free contact.friction', environment, code=2)


def show_in_browser(environment: Path) -> None:
    """Ask the panel of a recording for its page."""
    command = [str(environment / 'bin/stickslip'), 'panel', 'run.mcap', '--port', '0', '--json']
    with subprocess.Popen(
        command, cwd=environment, env=surroundings(), stdout=subprocess.PIPE
    ) as panel:
        assert panel.stdout is not None, 'it is a pipe'
        address = json.loads(panel.stdout.readline())['address']
        with urllib.request.urlopen(address) as page:
            print(f'panel of a recording: {page.status}, {len(page.read())} bytes', flush=True)
        panel.send_signal(signal.SIGINT)


def said(
    words: str, environment: Path, code: int = 0, variables: dict[str, str] | None = None
) -> str:
    """Run a program of an environment, there; return what it said; end if it ends otherwise."""
    program, *options = words.split()
    start_s = time.monotonic()
    done = subprocess.run(
        [environment / 'bin' / program, *options],
        cwd=environment,
        env=surroundings() | (variables or {}),
        capture_output=True,
        text=True,
        check=False,
    )
    is_refused = not done.stdout and done.stderr.count('\n') == 1
    if done.returncode != code or is_refused != bool(code):
        sys.exit(f'{words}: exit code {done.returncode}\n{done.stdout}{done.stderr}')
    print(f'{words}: {time.monotonic() - start_s:.1f} s', flush=True)
    return done.stdout


def run(*words: object, cwd: Path | None = None) -> None:
    """Run a tool, which must succeed."""
    subprocess.run([*map(str, words)], cwd=cwd, env=surroundings(), check=True)


def surroundings() -> dict[str, str]:
    """Return the variables of this process that suit another environment."""
    return {name: value for name, value in os.environ.items() if name not in FOREIGN}


if __name__ == '__main__':
    main()
