# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Launch files name what there is; where `launch` is installed, they are built too."""

import ast
import importlib.util
import re
import runpy
import shutil
import sys
import xml.etree.ElementTree as ET
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest
import yaml

from stickslip_ros.errors import RecordingError, UnknownName
from stickslip_ros.parameters import specs

ROOT = Path(__file__).resolve().parents[1]
FILES = sorted((ROOT / 'launch').glob('*.launch.py'))
DRIVE = ROOT / 'launch' / 'drive.launch.py'
STAGE = ROOT / 'launch' / 'stage.launch.py'
PAGES = [ROOT / 'README.md', *(ROOT / 'docs').rglob('*.md'), *FILES]
COMMAND = re.compile(r'ros2 launch stickslip_ros (\S+\.launch\.py)((?: \\?\s*[\w-]+(?::=\S+)?)*)')


def table_of(file: Path, name: str) -> dict[str, Any]:
    """Return the keys of a table of a launch file, and their values where they are plain."""
    for node in ast.parse(file.read_text(encoding='utf-8')).body:
        if isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == name:
            assert isinstance(node.value, ast.Dict)
            pairs = zip(node.value.keys, node.value.values, strict=True)
            return {
                ast.literal_eval(key): value.value if isinstance(value, ast.Constant) else None
                for key, value in pairs
                if key is not None
            }
    raise KeyError(name)


FOREIGN = {
    'controller_manager': {'ros2_control_node', 'spawner'},
    'nav2_lifecycle_manager': {'lifecycle_manager'},
    'robot_state_publisher': {'robot_state_publisher'},
    'rviz2': {'rviz2'},
}
"""Executables that other packages have."""
OWN = {'stage.launch.py': {'z_load', 'x', 'y', 'z'}, 'twin.launch.py': {'map'}}
"""Arguments that drive.launch.py has not."""
ARGUMENTS = table_of(DRIVE, 'ARGUMENTS').keys()
VALUES = {
    'params_file': str(ROOT / 'config' / 'coupled.yaml'),
    **dict.fromkeys(('stage', 'x', 'y', 'z'), 'clamp'),
}
"""Values of arguments that do not take any text."""


def test_all_are_installed_and_shipped(keywords: dict[str, Any]):
    shares = dict(keywords['data_files'])
    assert shares['share/stickslip_ros/launch'] == [f'launch/{file.name}' for file in FILES]
    manifest = (ROOT / 'MANIFEST.in').read_text(encoding='utf-8')
    assert 'graft launch\n' in manifest


def test_a_prefix_stands_before_the_frames_that_are_declared():
    frames = {name: spec.default for name, spec in specs().items() if name.startswith('frame_id.')}
    assert table_of(DRIVE, 'FRAMES') == frames


class StandIn:
    """What a file makes of a class of `launch`: its arguments."""

    def __init__(self, *values: Any, **named: Any) -> None:
        self.values, self.named = values, named


KINDS = {
    'launch': ('Action', 'LaunchContext', 'LaunchDescription'),
    'launch.actions': (
        'DeclareLaunchArgument',
        'ExecuteProcess',
        'IncludeLaunchDescription',
        'OpaqueFunction',
    ),
    'launch.substitutions': ('LaunchConfiguration',),
    'launch_ros': (),
    'launch_ros.actions': ('LifecycleNode', 'Node'),
    'launch_ros.parameter_descriptions': ('ParameterValue',),
}


class Launched:
    """What `ros2 launch` makes of a file and arguments: those that it shows, and the nodes."""

    def __init__(self, file: Path, given: dict[str, str]) -> None:
        self.context = dict(given)
        self.nodes: list[tuple[str, dict[str, Any]]] = []
        self.shown = self.include(file)

    def include(self, file: Path) -> set[str]:
        """Carry out a file; return the arguments that it shows."""
        [actions] = runpy.run_path(str(file))['generate_launch_description']().values
        return set().union(*map(self.carry_out, actions))

    def carry_out(self, action: Any) -> set[str]:
        """Carry out an action; return the arguments that it shows."""
        kind = type(action).__name__
        if kind == 'DeclareLaunchArgument':
            self.context.setdefault(action.values[0], action.named['default_value'])
            return {action.values[0]}
        if kind == 'IncludeLaunchDescription':
            handed = dict(action.named.get('launch_arguments', ()))
            self.context.update(handed)
            shown = self.include(Path(action.values[0]))
            assert handed.keys() <= shown
            return shown
        if kind == 'OpaqueFunction':
            for each in action.named['function'](self):
                self.carry_out(each)
            return set()
        words = {name: self.said(value) for name, value in action.named.items()}
        self.nodes.append((kind, words))
        return set()

    def said(self, value: Any) -> Any:
        """Return a word, list or table of a node, with the values of arguments in their places."""
        if isinstance(value, list):
            return [self.said(each) for each in value]
        if isinstance(value, dict):
            return {name: self.said(each) for name, each in value.items()}
        is_argument = type(value).__name__ == 'LaunchConfiguration'
        return self.context[value.values[0]] if is_argument else value


@pytest.fixture
def launch(monkeypatch: pytest.MonkeyPatch) -> Callable[..., Launched]:
    """Give what launches a file, without `launch`."""
    for name, kinds in KINDS.items():
        module = ModuleType(name)
        vars(module).update({kind: type(kind, (StandIn,), {}) for kind in kinds})
        monkeypatch.setitem(sys.modules, name, module)
    configuration = sys.modules['launch.substitutions'].LaunchConfiguration
    configuration.perform = lambda self, launched: launched.said(self)
    return lambda file, **given: Launched(file, given)


@pytest.mark.parametrize('file', FILES, ids=lambda file: file.name)
def test_executables_files_and_parameters_that_it_names_exist(launch, file, keywords):
    scripts = {line.split(' = ')[0] for line in keywords['entry_points']['console_scripts']}
    nodes = [words for kind, words in launch(file).nodes if kind.endswith('Node')]
    for words in nodes:
        ours = words['package'] == keywords['name']
        assert words['executable'] in (scripts if ours else FOREIGN[words['package']])
        tables = [each for each in words.get('parameters', ()) if isinstance(each, dict)]
        named = {name for table in tables for name in table if ours}
        assert named <= {*specs(), 'twin.map'}
        files = [*words.get('parameters', ()), *words.get('arguments', ())]
        ends = ('.yaml', '.rviz')
        assert all(Path(each).exists() for each in files if str(each).endswith(ends))
    assert nodes


@pytest.mark.parametrize('file', FILES, ids=lambda file: file.name)
def test_every_argument_that_it_shows_changes_what_is_started(launch, file):
    plain = launch(file)
    assert plain.shown <= ARGUMENTS | OWN.get(file.name, set())
    for name in plain.shown:
        value = VALUES.get(name, 'true')
        assert launch(file, **{name: value}).nodes != plain.nodes, name


def test_two_drives_differ_in_names_seeds_and_frames(launch: Callable[..., Launched]):
    file = ROOT / 'launch' / 'two_drives.launch.py'
    nodes = launch(file, log_level='warn', autostart='false').nodes
    for side, seed, (kind, words) in zip(('left', 'right'), '12', nodes, strict=True):
        named = (kind, words['namespace'], words['name'])
        assert named == ('LifecycleNode', side, 'stickslip_drive')
        assert words['ros_arguments'] == ['--log-level', 'warn']
        frames = {name: f'{side}/{frame}' for name, frame in table_of(DRIVE, 'FRAMES').items()}
        assert words['parameters'][1] == {'autostart': 'false', 'sim.seed': seed, **frames}


def test_a_stage_has_three_drives_in_its_namespace_and_one_description_of_all(launch):
    (_, bodies), *drives, (kind, load) = launch(STAGE, namespace='lab', z_load='-0.1').nodes
    for axis, (_, words) in zip('xyz', drives, strict=True):
        assert (words['namespace'], words['name']) == (f'lab/{axis}', 'stickslip_drive')
        assert words['remappings'] == [('joint_states', '/lab/joint_states')]
        frames = {name: f'{axis}/{frame}' for name, frame in table_of(DRIVE, 'FRAMES').items()}
        own = {'sim.joint_name': f'{axis}_joint', **frames}
        assert words['parameters'][1].items() > own.items()
    assert len({words['parameters'][1]['sim.seed'] for _, words in drives}) == 3
    [text] = bodies['parameters'][0]['robot_description'].values
    joints = {each.get('name'): each.get('type') for each in ET.fromstring(text).iter('joint')}
    moving = {name for name, kind_of in joints.items() if kind_of == 'prismatic'}
    assert moving == {f'{axis}_joint' for axis in 'xyz'}
    assert (kind, bodies['namespace']) == ('ExecuteProcess', 'lab')
    sent = 'command load force.x=-0.1 --namespace /lab/z --timeout 120'
    assert load['cmd'][4:] == sent.split()


def test_each_axis_of_a_stage_can_be_of_another_kind_below_the_file_of_the_user(launch):
    own = VALUES['params_file']
    _, *drives, _ = launch(STAGE, x='clamp', y='walker', params_file=own).nodes
    files = [words['parameters'][:-1] for _, words in drives]
    kinds = [str(ROOT / 'config' / 'stages' / f'{name}.yaml') for name in ('clamp', 'walker')]
    assert files == [[kinds[0], own], [kinds[1], own], [own]]


def test_a_stage_stands_alone_if_no_file_is_given(launch: Callable[..., Launched]):
    [(_, words)] = launch(DRIVE, stage='walker').nodes
    assert words['parameters'][:-1] == [str(ROOT / 'config' / 'stages' / 'walker.yaml')]
    with pytest.raises(UnknownName, match='the stages are clamp, '):
        launch(DRIVE, stage='screw')


def test_the_manager_of_nav2_keeps_no_bond_and_finds_the_drive(launch: Callable[..., Launched]):
    file = ROOT / 'launch' / 'nav2_lifecycle.launch.py'
    (_, manager), (_, drive) = launch(file, name='stage', namespace='left').nodes
    assert manager['parameters'] == [
        {'autostart': True, 'bond_timeout': 0.0, 'node_names': ['stage']}
    ]
    assert manager['namespace'] == drive['namespace'] == 'left'
    assert (drive['name'], drive['parameters'][1]) == ('stage', {'autostart': 'false'})


def test_ros2_control_has_description_manager_and_controllers_before_the_drive(launch):
    nodes = launch(ROOT / 'launch' / 'ros2_control.launch.py').nodes
    (_, bodies), (_, manager), (_, spawner), (_, drive) = nodes
    [text] = bodies['parameters'][0]['robot_description'].values
    robot = ET.fromstring(text)
    [joint] = robot.iterfind('ros2_control/joint')
    assert joint.get('name') in {each.get('name') for each in robot.iterfind('joint')}
    assert drive['parameters'][1] == {'sim.joint_name': joint.get('name')}
    topics = {each.get('name'): each.text for each in robot.iterfind('ros2_control/*/param')}
    assert drive['remappings'] == [('joint_states', topics['joint_states_topic'])]
    [file] = manager['parameters']
    assert spawner['arguments'][-2:] == ['--param-file', file]
    controllers = yaml.safe_load(Path(file).read_text(encoding='utf-8'))['controller_manager']
    assert set(spawner['arguments'][:-2]) < controllers['ros__parameters'].keys()


@pytest.mark.parametrize('rviz', [None, '/opt/ros/bin/rviz2'])
def test_the_view_shows_the_bodies_of_the_stand_in_the_frames_of_its_drive(
    launch: Callable[..., Launched], monkeypatch: pytest.MonkeyPatch, rviz: str | None
):
    monkeypatch.setattr(shutil, 'which', lambda name: {'rviz2': rviz}[name])
    file = ROOT / 'launch' / 'view.launch.py'
    (_, bodies), *others, (_, drive) = launch(
        file,
        params_file=str(ROOT / 'config' / 'realistic.yaml'),
        frame_prefix='left/',
        namespace='left',
    ).nodes
    assert drive['package'] == 'stickslip_ros'  # last: what is missing leaves no drive behind
    assert drive['namespace'] == bodies['namespace'] == 'left'
    [text] = bodies['parameters'][0]['robot_description'].values
    links = {link.attrib['name'] for link in ET.fromstring(text).iter('link')}
    frames = table_of(DRIVE, 'FRAMES').values()
    assert {f'left/{frame}' for frame in frames} <= links
    assert [words['arguments'][-1] for _, words in others] == ['left/stage_base'] * bool(rviz)


@pytest.mark.parametrize('file', FILES, ids=lambda file: file.name)
def test_a_file_of_parameters_that_is_not_there_starts_nothing(launch, file, tmp_path):
    missing = str(tmp_path / 'none.yaml')
    with pytest.raises((FileNotFoundError, RecordingError), match=missing):
        launch(file, params_file=missing)


@pytest.mark.parametrize('page', PAGES, ids=lambda page: page.name)
def test_files_and_arguments_that_a_page_names_exist(launch: Callable[..., Launched], page: Path):
    for name, words in COMMAND.findall(page.read_text(encoding='utf-8')):
        assert ROOT / 'launch' / name in FILES
        given = set(re.findall(r'(\w+):=', words))
        assert given <= launch(ROOT / 'launch' / name).shown


def test_the_pages_name_every_launch_file():
    pages = ''.join(page.read_text(encoding='utf-8') for page in PAGES if page not in FILES)
    assert {name for name, _ in COMMAND.findall(pages)} == {file.name for file in FILES}


@pytest.mark.skipif(
    importlib.util.find_spec('launch_ros') is None,
    reason='launch_ros is not among the wheels; it comes with an installed ROS 2',
)
@pytest.mark.parametrize('file', FILES, ids=lambda file: file.name)
def test_its_description_can_be_built_and_shows_the_arguments_that_it_has(file: Path):
    description = runpy.run_path(str(file))['generate_launch_description']()
    declared = [each.name for each in description.get_launch_arguments()]
    fixed = set(runpy.run_path(str(file)).get('OWN', {}))
    own = {'seed', 'joint_name', 'frame_prefix', 'joint_states', 'name', 'stage'}
    own = {'two_drives': {'namespace', 'seed', 'frame_prefix'}, 'stage': own}.get(
        file.name.partition('.')[0], fixed
    )
    assert set(declared) == (ARGUMENTS | OWN.get(file.name, set())) - own
