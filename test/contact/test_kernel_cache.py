"""Where machine code is kept: a folder per version of the sources, where it can be written."""

import shutil
from pathlib import Path

import pytest

from stickslip_ros.contact import kernel as kernel_module
from stickslip_ros.contact.kernel import CONFIG, KERNEL_FOLDERS, cache_dir

# Where it is read once, a test may ask again.
fresh_cache_dir = cache_dir.__wrapped__


@pytest.fixture
def package(tmp_path, monkeypatch) -> Path:
    """Give a copy of the kernel sources that the function takes for its own package."""
    original = Path(kernel_module.__file__).resolve().parent.parent
    copy = tmp_path / 'package'
    for folder in KERNEL_FOLDERS:
        shutil.copytree(original / folder, copy / folder, ignore=shutil.ignore_patterns('__*__'))
    monkeypatch.setattr(kernel_module, '__file__', str(copy / 'contact/kernel.py'))
    monkeypatch.setattr(CONFIG, 'CACHE_DIR', '')
    return copy


def test_the_folder_lies_in_the_package_if_that_can_be_written(package):
    assert fresh_cache_dir().parent == package / '__pycache__'
    assert fresh_cache_dir().name.startswith('stickslip_ros-')


def test_the_folder_stays_the_same_while_the_sources_do(package):
    before = fresh_cache_dir()
    (package / 'README.md').write_text('no source', encoding='utf-8')
    assert fresh_cache_dir() == before


@pytest.mark.parametrize(
    'source', ['contact/memory.py', 'drive/plant.py', 'instrument/optics.py', 'drive/new.py']
)
def test_a_changed_source_gets_another_folder(source, package):
    before = fresh_cache_dir()
    with (package / source).open('a', encoding='utf-8') as file:
        file.write('# another line\n')
    after = fresh_cache_dir()
    assert after.parent == before.parent
    assert after.name != before.name


def test_a_place_that_is_asked_for_comes_first(package, tmp_path, monkeypatch):
    monkeypatch.setattr(CONFIG, 'CACHE_DIR', str(tmp_path / 'asked/for'))
    assert fresh_cache_dir().parent == tmp_path / 'asked/for'


def test_a_place_that_cannot_be_made_is_passed_over(package, tmp_path, monkeypatch):
    # A file where a folder should be stops root too.
    (tmp_path / 'asked').write_text('', encoding='utf-8')
    monkeypatch.setattr(CONFIG, 'CACHE_DIR', str(tmp_path / 'asked'))
    assert fresh_cache_dir().parent == package / '__pycache__'

    (package / '__pycache__').rmdir()
    (package / '__pycache__').write_text('', encoding='utf-8')
    monkeypatch.setenv('XDG_CACHE_HOME', str(tmp_path / 'user'))
    assert fresh_cache_dir().parent == tmp_path / 'user'

    monkeypatch.delenv('XDG_CACHE_HOME')
    monkeypatch.setenv('HOME', str(tmp_path / 'home'))
    assert fresh_cache_dir().parent == tmp_path / 'home/.cache'


def test_a_place_that_cannot_be_written_is_passed_over(package, tmp_path, monkeypatch):
    monkeypatch.setattr(
        kernel_module.os, 'access', lambda place, mode: Path(place) == tmp_path / 'user'
    )
    monkeypatch.setenv('XDG_CACHE_HOME', str(tmp_path / 'user'))
    assert fresh_cache_dir().parent == tmp_path / 'user'


def test_the_temporary_folder_is_the_last_resort(package, tmp_path, monkeypatch):
    monkeypatch.setattr(kernel_module.os, 'access', lambda place, mode: False)
    monkeypatch.setenv('XDG_CACHE_HOME', str(tmp_path / 'user'))
    monkeypatch.setattr(kernel_module.tempfile, 'gettempdir', lambda: str(tmp_path / 'temporary'))
    assert fresh_cache_dir().parent == tmp_path / 'temporary'


def test_compiling_a_kernel_leaves_the_settings_of_numba_as_they_were():
    before = CONFIG.CACHE_DIR
    twice = kernel_module.kernel(lambda value: 2.0 * value)
    assert before == CONFIG.CACHE_DIR
    assert twice(1.5) == 3.0
