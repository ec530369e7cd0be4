# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""What the package says of itself agrees: package.xml, setup.py, code, files, and a release."""

import ast
import importlib
import os
import re
import subprocess
import sys
from collections import defaultdict
from functools import cache
from graphlib import TopologicalSorter
from pathlib import Path
from xml.etree import ElementTree as ET

import pytest
import yaml
from catkin_pkg.package import parse_package
from processes import run_process

from stickslip_ros import __version__

ROOT = Path(__file__).resolve().parents[1]
NAME = 'stickslip_ros'


@pytest.fixture
def manifest() -> ET.Element:
    return ET.parse(ROOT / 'package.xml').getroot()


def test_package_xml_is_accepted_without_a_warning():
    warnings: list[str] = []
    parsed = parse_package(ROOT / 'package.xml', warnings=warnings)
    assert parsed.get_build_type() == 'ament_python'
    assert warnings == []


def test_package_xml_setup_and_citation_say_the_same(keywords, manifest):
    citation = yaml.safe_load((ROOT / 'CITATION.cff').read_text(encoding='utf-8'))
    addresses = {each.get('type'): each.text for each in manifest.iter('url')}
    maintainer = manifest.find('maintainer')
    for told in (
        (NAME, keywords['name'], manifest.findtext('name')),
        (__version__, keywords['version'], manifest.findtext('version'), citation['version']),
        ('Apache-2.0', keywords['license'], manifest.findtext('license'), citation['license']),
        (keywords['maintainer'], maintainer.text),
        (keywords['maintainer_email'], maintainer.get('email')),
        (keywords['author'], manifest.findtext('author'), citation['authors'][0]['name']),
        (keywords['url'], addresses['repository'], citation['repository-code']),
        (keywords['project_urls']['Issues'], addresses['bugtracker']),
    ):
        assert len({*told}) == 1, told


def test_the_description_leads_to_files_of_this_version(keywords):
    links = re.findall(r'\]\((?!http)[^)]*|\]\((http[^)]*)', keywords['long_description'])
    at = f'/v{__version__}/'
    inside = [each.partition(at)[2] for each in links if each.startswith(keywords['url'])]
    assert 'docs/images/panel.png' in inside
    assert [each for each in inside if not (ROOT / each.partition('#')[0]).exists()] == []
    assert '' not in links  # none is relative


def test_the_changelog_begins_with_this_version_or_the_next():
    text = (ROOT / 'CHANGELOG.rst').read_text(encoding='utf-8')
    first = re.search(r'^(\S.*)\n-+$', text, re.MULTILINE)[1]
    assert first == 'Forthcoming' or first.startswith(f'{__version__} (')


def test_every_data_file_exists_and_ament_finds_its_own(keywords):
    installed = {folder: list(files) for folder, files in keywords['data_files']}
    missing = [
        file for files in installed.values() for file in files if not (ROOT / file).is_file()
    ]
    assert missing == []
    assert installed['share/ament_index/resource_index/packages'] == [f'resource/{NAME}']
    assert installed[f'share/{NAME}'] == ['package.xml']
    assert 'config/test_stand.yaml' in installed[f'share/{NAME}/config']


def test_every_folder_with_modules_of_the_package_is_installed_and_no_other(keywords):
    folders = {module.parent for module in (ROOT / NAME).rglob('*.py')}
    names = {'.'.join(folder.relative_to(ROOT).parts) for folder in folders}
    assert names == set(keywords['packages'])


def test_console_scripts_lead_to_callables_and_a_wheel_has_a_launcher_of_each(keywords):
    scripts = dict(line.split(' = ') for line in keywords['entry_points']['console_scripts'])
    for target in scripts.values():
        module, _, function = target.partition(':')
        assert callable(getattr(importlib.import_module(module), function))
    launchers = sorted((ROOT / 'scripts/ros2run').iterdir())
    assert [launcher.name for launcher in launchers] == sorted(scripts)
    assert all(os.access(launcher, os.X_OK) for launcher in launchers)


def test_the_distribution_is_never_mixed(keywords):
    extras = keywords['extras_require']
    for distribution in ('jazzy', 'kilted'):
        assert all(name.startswith(f'ros-{distribution}-') for name in extras[distribution])
        lock = (ROOT / 'requirements' / f'{distribution}.txt').read_text(encoding='utf-8')
        other = 'kilted' if distribution == 'jazzy' else 'jazzy'
        assert f'ros-{distribution}-rclpy' in lock
        assert f'ros-{other}-' not in lock


def test_every_pin_of_every_lock_has_a_hash():
    locks = sorted((ROOT / 'requirements').glob('*.txt'))
    pin = re.compile(r'^(\S+==\S+).*((?:\n    --hash=sha256:\w{64}.*)*)', re.MULTILINE)
    pins = [(lock.name, *pair) for lock in locks for pair in pin.findall(lock.read_text())]
    assert {name for name, *_ in pins} == {lock.name for lock in locks}
    assert [(name, pinned) for name, pinned, hashes in pins if not hashes] == []
    makefile = (ROOT / 'Makefile').read_text(encoding='utf-8')
    assert re.findall(r'install (?:\S+ )*-r', makefile) == ['install --require-hashes -r'] * 3
    assert not re.search(r'[\w)]==[\w$]', makefile)  # no version stands beside the locks


def test_the_hooks_are_the_checks_of_make_lint():
    makefile = (ROOT / 'Makefile').read_text(encoding='utf-8')
    hooks = yaml.safe_load((ROOT / '.pre-commit-config.yaml').read_text(encoding='utf-8'))
    [local] = hooks['repos']
    entries = [hook['entry'].rpartition(' ')[2] for hook in local['hooks']]
    assert local['repo'] == 'local'
    assert f'LINT := {" ".join(entries)}\n' in makefile


def test_what_is_installed_is_declared_for_ros_too(keywords, manifest):
    extras = keywords['extras_require']
    of_pip_alone = {'mcap>=1.5', 'rosbags>=0.11.9'}
    needed = {
        'exec_depend': {*keywords['install_requires']} - of_pip_alone,
        'test_depend': {*extras['lab'], *extras['panel']} - of_pip_alone,
    }
    for kind, requirements in needed.items():
        keys = {each.text: each.get('version_gte', '') for each in manifest.iter(kind)}
        for name, _, oldest in (each.partition('>=') for each in requirements):
            assert keys[f'python3-{name.lower().removeprefix("py")}'] == oldest, name
    assert not re.search('mcap|rosbags', ''.join(each.text or '' for each in manifest))


def test_pythons_and_numba_are_the_same_everywhere(keywords):
    pythons = [f'3.{minor}' for minor in range(10, 15)]
    classifiers = [each.rpartition(' ')[2] for each in keywords['classifiers']]
    assert [each for each in classifiers if each.startswith('3.')] == pythons
    makefile = (ROOT / 'Makefile').read_text(encoding='utf-8')
    assert f'for version in {" ".join(pythons)} ' in makefile
    assert '(3, 10) <= v <= (3, 14)' in makefile
    wheel = (ROOT / 'scripts' / 'wheel_check.py').read_text(encoding='utf-8')
    assert f'PYTHONS = {", ".join(map(repr, pythons))}\n' in wheel
    workflow = yaml.safe_load((ROOT / '.github' / 'workflows' / 'ci.yml').read_text('utf-8'))
    assert workflow['jobs']['test']['strategy']['matrix']['python'] == pythons
    [step] = [
        s for s in workflow['jobs']['wheel']['steps'] if 'python-version' in s.get('with', {})
    ]
    assert {*step['with']['python-version'].split()} == {*pythons}
    pages = [ROOT / 'README.md', ROOT / 'CONTRIBUTING.md', *(ROOT / 'docs').rglob('*.md')]
    told = [
        text
        for page in pages
        for text in re.findall(r'3\.10 to (3\.\d+)', page.read_text('utf-8'))
    ]
    assert {*told} - {'3.12'} == {pythons[-1]}  # 3.12: of `make foreign`
    kernel = (ROOT / NAME / 'kernels' / 'kernel.py').read_text(encoding='utf-8')
    [numba] = [each for each in keywords['install_requires'] if each.startswith('numba')]
    assert f'the oldest is {numba.partition(">=")[2]}.' in kernel


PART_VERBS = {'arrive', 'cut', 'end_stretch', 'feel', 'look_ahead', 'pass_middle', 'swing'}
"""Verbs of the parts of the drive, each called once in `take_stride` or in a long step."""
SHARED_NAMES = PART_VERBS | {
    'ANSWERS',  # of each module of the self-test, and of all of them
    'main',  # of each executable
}


def names_of(statement: ast.stmt) -> list[str]:
    """Return the names that a statement at the top of a module defines."""
    if isinstance(statement, ast.FunctionDef | ast.ClassDef):
        return [statement.name]
    targets = statement.targets if isinstance(statement, ast.Assign) else []
    targets = [statement.target] if isinstance(statement, ast.AnnAssign) else targets
    flat = [each for target in targets for each in getattr(target, 'elts', [target])]
    return [each.id for each in flat if isinstance(each, ast.Name)]


@cache
def tree_of(path: Path) -> ast.Module:
    """Return the syntax tree of a module."""
    return ast.parse(path.read_text(encoding='utf-8'))


def test_one_public_name_has_one_meaning():
    places = defaultdict(set)
    for path in sorted((ROOT / NAME).rglob('*.py')):
        tree = tree_of(path)
        inner = [node.name for node in ast.walk(tree) if isinstance(node, ast.ClassDef)]
        for name in [*inner, *(each for line in tree.body for each in names_of(line))]:
            if not name.startswith('_'):
                places[name].add(str(path.relative_to(ROOT)))
    twice = {name: found for name, found in places.items() if len(found) > 1}
    assert twice.keys() >= SHARED_NAMES
    assert {name: twice[name] for name in twice.keys() - SHARED_NAMES} == {}


def test_no_module_imports_itself_through_others_not_even_late():
    paths = {
        '.'.join(path.relative_to(ROOT).with_suffix('').parts).removesuffix('.__init__'): path
        for path in (ROOT / NAME).rglob('*.py')
    }
    imported = {module: set[str]() for module in paths}
    for module, path in paths.items():
        for node in ast.walk(tree_of(path)):
            if isinstance(node, ast.ImportFrom):
                inside = {f'{node.module}.{each.name}' for each in node.names} & paths.keys()
                imported[module] |= inside or {str(node.module)}
            elif isinstance(node, ast.Import):
                imported[module] |= {each.name for each in node.names}
    assert f'{NAME}.lab.fitting.figure' in imported[f'{NAME}.lab.fitting.report']  # a late one
    TopologicalSorter(imported).prepare()  # a CycleError names the circle


def test_no_function_has_more_than_eight_parameters():
    long, places = list[str](), (ROOT / NAME, ROOT / 'test' / 'evidence')
    for path in sorted(each for place in places for each in place.rglob('*.py')):
        for node in ast.walk(tree_of(path)):
            if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
                given = node.args
                names = [each.arg for each in (*given.posonlyargs, *given.args, *given.kwonlyargs)]
                if len(set(names) - {'self', 'cls'}) > 8:
                    long.append(f'{path.relative_to(ROOT)}:{node.lineno} {node.name}')
    assert long == []


def test_a_workflow_runs_what_was_looked_at_and_keeps_no_credentials():
    for path in (ROOT / '.github' / 'workflows').glob('*.yml'):
        text = path.read_text(encoding='utf-8')
        for used in re.findall(r'uses: (.*)', text):
            assert re.fullmatch(r'[\w-]+/[\w-]+@[0-9a-f]{40} # v[\d.]+', used), used
        assert text.count('persist-credentials: false') == text.count('actions/checkout@')
        assert all('@${{ matrix.digest }}' in each for each in re.findall('container: (.*)', text))


WRITTEN = 'setup.py', 'package.xml', 'CITATION.cff'
URL, MAIL = 'https://example.org/stickslip', 'someone@example.org'


@pytest.fixture
def copy(tmp_path: Path) -> Path:
    """Return a folder with what the script reads, as it is before the first release."""
    read = 'CHANGELOG.rst', 'scripts/release.py', 'stickslip_ros/__init__.py'
    setup = (ROOT / 'setup.py').read_text()
    stands_for = {
        re.findall("HOME = '(.*)'", setup)[0]: 'https://stickslip-ros.invalid',
        re.findall("maintainer_email='(.*)'", setup)[0]: 'noreply@stickslip-ros.invalid',
    }
    for name in (*WRITTEN, *read):
        text = (ROOT / name).read_text()
        for said in stands_for if name in WRITTEN else ():
            text = text.replace(said, stands_for[said])
        text = text.replace('Forthcoming\n---', f'{__version__} (2026-01-01)\n---')
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(text)
    return tmp_path


def release(folder: Path, *asked: str) -> 'subprocess.CompletedProcess[str]':
    command = [sys.executable, str(folder / 'scripts/release.py'), *asked]
    return run_process(command)


def test_a_release_has_the_addresses_that_were_said_and_no_word_that_there_are_none(copy):
    assert release(copy, URL, MAIL).returncode == 0
    for name in WRITTEN:
        text = (copy / name).read_text()
        assert URL in text
        for placeholder in ('.invalid', 'RFC 2606', 'no public host'):
            assert placeholder not in text, name
    assert f'<maintainer email="{MAIL}">' in (copy / 'package.xml').read_text()
    assert 'written before' in release(copy).stdout


@pytest.mark.parametrize(
    'asked',
    [
        ('http://example.org', MAIL),
        (f'{URL}/', MAIL),
        (URL, 'nobody'),
        *((f'{URL}{sign}b', MAIL) for sign in '&<\'"\\{#'),
        *((URL, f'{sign}{MAIL}') for sign in '&<\'"\\{#'),
    ],
)
def test_what_is_no_address_is_refused_before_anything_is_written(copy, asked):
    before = {name: (copy / name).read_text() for name in WRITTEN}
    assert 'give an address' in release(copy, *asked).stderr
    assert {name: (copy / name).read_text() for name in WRITTEN} == before


@pytest.mark.parametrize(
    ('name', 'broken'),
    [('setup.py', "it's"), ('package.xml', '<url>'), ('CITATION.cff', 'a: b: c')],
)
def test_a_file_that_would_be_broken_leaves_all_as_they_were(copy, name, broken):
    with (copy / name).open('a') as file:
        file.write(f'{broken}\n')
    before = {name: (copy / name).read_text() for name in WRITTEN}
    done = release(copy, URL, MAIL)
    assert done.returncode == 1
    assert done.stderr.startswith(f'{name} would be broken, and nothing was written: ')
    assert {name: (copy / name).read_text() for name in WRITTEN} == before
