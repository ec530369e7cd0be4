"""Launch files name what there is; where `launch` is installed, they are built too."""

import ast
import importlib.util
import re
import runpy
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from stickslip_ros.parameters import ControllerParameters, declared_by, specs

ROOT = Path(__file__).resolve().parents[1]
FILES = sorted((ROOT / 'launch').glob('*.launch.py'))
DRIVE = ROOT / 'launch' / 'drive.launch.py'
PAGES = [ROOT / 'README.md', *(ROOT / 'docs').glob('*.md'), *FILES]
COMMAND = re.compile(r'ros2 launch stickslip_ros (\S+\.launch\.py)((?: \\?\s*[\w-]+(?::=\S+)?)*)')


def calls_of(file: Path) -> Iterator[tuple[str, dict[str, ast.expr]]]:
    """Give the name and the keywords of every call in a launch file."""
    for node in ast.walk(ast.parse(file.read_text(encoding='utf-8'))):
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
            yield node.func.id, {each.arg: each.value for each in node.keywords if each.arg}


def texts_of(file: Path) -> set[str]:
    """Return every text in a launch file."""
    tree = ast.parse(file.read_text(encoding='utf-8'))
    constants = (node.value for node in ast.walk(tree) if isinstance(node, ast.Constant))
    return {value for value in constants if isinstance(value, str)}


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


ARGUMENTS = table_of(DRIVE, 'ARGUMENTS').keys()


def test_all_are_installed_and_shipped(keywords: dict[str, Any]):
    shares = dict(keywords['data_files'])
    assert shares['share/stickslip_ros/launch'] == [f'launch/{file.name}' for file in FILES]
    assert len(FILES) == 3
    manifest = (ROOT / 'MANIFEST.in').read_text(encoding='utf-8')
    assert 'recursive-include launch *.launch.py\n' in manifest


@pytest.mark.parametrize('file', FILES, ids=lambda file: file.name)
def test_executables_files_and_parameters_that_it_names_exist(
    file: Path, keywords: dict[str, Any]
):
    scripts = {line.split(' = ')[0] for line in keywords['entry_points']['console_scripts']}
    for name, words in calls_of(file):
        if name in ('Node', 'LifecycleNode'):
            assert ast.literal_eval(words['package']) == keywords['name']
            assert ast.literal_eval(words['executable']) in scripts
    texts = texts_of(file)
    for name in (text for text in texts if text.endswith(('.yaml', '.launch.py'))):
        assert (ROOT / 'config' / name).exists() or (file.parent / name).exists()
    groups = '|'.join({name.partition('.')[0] for name in specs() if '.' in name})
    named = {text for text in texts if re.fullmatch(rf'(?:{groups})\.\w+', text)}
    assert named <= specs().keys()
    assert {'target_frame'} & texts <= declared_by(ControllerParameters).keys()


def test_a_prefix_stands_before_the_frames_that_are_declared():
    frames = {name: spec.default for name, spec in specs().items() if name.startswith('frame_id.')}
    assert table_of(DRIVE, 'FRAMES') == frames


@pytest.mark.parametrize('file', FILES, ids=lambda file: file.name)
def test_arguments_that_it_hands_on_or_reads_are_declared(file: Path):
    tree = ast.parse(file.read_text(encoding='utf-8'))
    for node in ast.walk(tree):
        if not isinstance(node, ast.Call):
            continue
        if ast.unparse(node.func) == 'LaunchConfiguration' and file != DRIVE:
            assert ast.literal_eval(node.args[0]) in ARGUMENTS
        for keyword in node.keywords:
            if keyword.arg == 'launch_arguments':
                handed = re.findall(r"'(\w+)':", ast.unparse(keyword.value))
                assert handed
                assert set(handed) <= ARGUMENTS


@pytest.mark.parametrize('page', PAGES, ids=lambda page: page.name)
def test_files_and_arguments_that_a_page_names_exist(page: Path):
    for name, words in COMMAND.findall(page.read_text(encoding='utf-8')):
        assert ROOT / 'launch' / name in FILES
        given = set(re.findall(r'(\w+):=', words))
        assert given <= ARGUMENTS


def test_the_pages_name_every_launch_file():
    pages = ''.join(page.read_text(encoding='utf-8') for page in PAGES if page not in FILES)
    assert {name for name, _ in COMMAND.findall(pages)} == {file.name for file in FILES}


@pytest.mark.skipif(
    importlib.util.find_spec('launch_ros') is None,
    reason='launch_ros is not among the wheels; it comes with an installed ROS 2',
)
@pytest.mark.parametrize('file', FILES, ids=lambda file: file.name)
def test_its_description_can_be_built_and_has_the_arguments_of_the_drive(file: Path):
    description = runpy.run_path(str(file))['generate_launch_description']()
    declared = [each.name for each in description.get_launch_arguments()]
    assert set(declared) == set(ARGUMENTS)
