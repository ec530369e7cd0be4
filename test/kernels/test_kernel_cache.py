# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Cache of machine code: a folder for each version of the sources, closed to others."""

import importlib
import os
import pickle
import random
import shutil
import sys
import tempfile
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from itertools import chain
from pathlib import Path
from threading import Barrier
from typing import Any

import numba
import pytest
from llvmlite.binding import get_host_cpu_features
from processes import run_process

from stickslip_ros.kernels import cache as kernel_cache
from stickslip_ros.kernels.cache import CONFIG, Folders, cache_folders, cache_problem
from stickslip_ros.kernels.kernel import entry_point, in_python, kernel
from stickslip_ros.sources import FOLDERS, sources_digest

BIN = Path(sys.executable).parent
MINE = os.geteuid()
NOBODY = 65534
ROUNDS = 50
KEPT = '*.twice-*.nbc'
"""The machine code of `twice` in a folder."""


def fresh_folders() -> Folders:
    """Return the folders again, although a program asks once."""
    sources_digest.cache_clear()
    folders: Folders = cache_folders.__wrapped__()
    return folders


@entry_point
def twice(value):
    return 2.0 * value


@kernel
def thrice(value):
    return 3.0 * value


@pytest.fixture
def package(tmp_path, monkeypatch) -> Iterator[Path]:
    """Give a copy of the kernel sources that the functions take for their own package."""
    original = Path(kernel_cache.__file__).resolve().parent.parent
    copy = tmp_path / 'package'
    for folder in FOLDERS:
        shutil.copytree(original / folder, copy / folder, ignore=shutil.ignore_patterns('__*__'))
    monkeypatch.setattr(kernel_cache, '__file__', str(copy / 'contact/../kernels/cache.py'))
    monkeypatch.setattr(CONFIG, 'CACHE_DIR', '')
    monkeypatch.setenv('XDG_CACHE_HOME', str(tmp_path / 'user'))
    cache_folders.cache_clear()
    yield copy
    cache_folders.cache_clear()


def test_the_folder_lies_in_the_package_if_that_can_be_written(package):
    folders = fresh_folders()
    assert folders.write.parent == package / '__pycache__'
    assert folders.write.name.startswith('stickslip_ros-')
    assert folders.read == (folders.write,)
    assert folders.write.stat().st_mode & 0o022 == 0
    assert not cache_problem()


def test_the_folder_stays_the_same_while_the_sources_do(package):
    before = fresh_folders()
    (package / 'README.md').write_text('no source', encoding='utf-8')
    assert fresh_folders() == before


@pytest.mark.parametrize(
    'source', ['contact/memory.py', 'drive/short_step.py', 'instrument/optics.py', 'drive/new.py']
)
def test_a_changed_source_gets_another_folder(source, package):
    before = fresh_folders().write
    with (package / source).open('a', encoding='utf-8') as file:
        file.write('# another line\n')
    after = fresh_folders().write
    assert after.parent == before.parent
    assert after.name != before.name


def test_a_place_that_is_asked_for_comes_first(package, tmp_path, monkeypatch):
    monkeypatch.setattr(CONFIG, 'CACHE_DIR', str(tmp_path / 'asked/for'))
    assert fresh_folders().write.parent == tmp_path / 'asked/for'


def test_a_place_that_cannot_be_made_is_passed_over(package, tmp_path, monkeypatch):
    # A file where a folder should be stops root too.
    (tmp_path / 'asked').write_text('', encoding='utf-8')
    monkeypatch.setattr(CONFIG, 'CACHE_DIR', str(tmp_path / 'asked'))
    assert fresh_folders().write.parent == package / '__pycache__'

    shutil.rmtree(package / '__pycache__')
    (package / '__pycache__').write_text('', encoding='utf-8')
    assert fresh_folders().write.parent == tmp_path / 'user'

    monkeypatch.delenv('XDG_CACHE_HOME')
    monkeypatch.setenv('HOME', str(tmp_path / 'home'))
    assert fresh_folders().write.parent == tmp_path / 'home/.cache'


@pytest.mark.parametrize('mode', [0o777, 0o770, 0o702])
def test_a_folder_that_others_can_write_is_passed_over(mode, package, tmp_path):
    folder = fresh_folders().write
    folder.chmod(mode)
    assert fresh_folders().read == (tmp_path / 'user' / folder.name,)


@pytest.mark.parametrize(
    ('mode', 'owner', 'group', 'is_taken'),
    [
        (0o777, MINE, MINE, False),
        (0o775, MINE, MINE + 1, False),
        (0o775, MINE, MINE, True),  # as a umask of 002 makes it
        (0o1777, MINE, MINE, True),  # where others cannot rename it
        (0o755, MINE + 1, MINE, False),
    ],
)
@pytest.mark.parametrize('above', ['', 'above'])
def test_a_place_where_others_can_rename_a_folder_is_passed_over(
    above, mode, owner, group, is_taken, package, tmp_path, monkeypatch
):
    place = tmp_path / 'asked' / above / 'for'
    place.mkdir(parents=True)
    (tmp_path / 'asked').chmod(mode)
    lstat = Path.lstat

    def of_others(path: Path) -> os.stat_result:
        found, is_it = lstat(path), path == tmp_path / 'asked'
        return os.stat_result((*found[:4], owner if is_it else MINE, group, *found[6:]))

    monkeypatch.setattr(Path, 'lstat', of_others)
    monkeypatch.setattr(CONFIG, 'CACHE_DIR', str(place))
    assert fresh_folders().write.parent == (place if is_taken else package / '__pycache__')


def test_a_link_to_a_place_is_followed_once(package, tmp_path, monkeypatch):
    (tmp_path / 'there').mkdir()
    (tmp_path / 'asked').symlink_to(tmp_path / 'there')
    monkeypatch.setattr(CONFIG, 'CACHE_DIR', str(tmp_path / 'asked'))
    assert fresh_folders().write.parent == tmp_path / 'there'


def test_a_link_to_a_folder_is_passed_over(package, tmp_path):
    folder = fresh_folders().write
    folder.rename(tmp_path / 'elsewhere')
    folder.symlink_to(tmp_path / 'elsewhere')
    assert fresh_folders().read == (tmp_path / 'user' / folder.name,)


def test_a_folder_of_another_user_is_passed_over_and_one_of_root_is_read(
    package, tmp_path, monkeypatch
):
    folder = fresh_folders().write
    monkeypatch.setattr(os, 'geteuid', lambda: MINE + 1)
    monkeypatch.setattr(kernel_cache, 'ROOT_USER', MINE + 2)
    (tmp_path / 'user').write_text('', encoding='utf-8')
    assert fresh_folders() == Folders((), None)
    monkeypatch.setattr(kernel_cache, 'ROOT_USER', MINE)
    assert fresh_folders() == Folders((folder,), None)
    folder.chmod(0o775)
    assert fresh_folders() == Folders((), None)


def test_an_own_folder_that_cannot_be_written_is_read(package, tmp_path, monkeypatch):
    folder = fresh_folders().write
    monkeypatch.setattr(os, 'access', lambda place, _: place != folder)
    own = tmp_path / 'user' / folder.name
    assert fresh_folders() == Folders((folder, own), own)


def test_without_a_folder_kernels_are_compiled_and_it_is_said(package, tmp_path, monkeypatch):
    (package / '__pycache__').write_text('', encoding='utf-8')
    (tmp_path / 'user').write_text('', encoding='utf-8')
    monkeypatch.setattr(kernel_cache, 'cache_folders', fresh_folders)
    monkeypatch.setattr(tempfile, 'tempdir', str(tmp_path))
    before = sorted(tmp_path.rglob('*'))
    assert fresh_folders() == Folders((), None)
    assert entry_point(lambda value: 4.0 * value)(1.5) == 6.0
    assert sorted(tmp_path.rglob('*')) == before
    why = cache_problem()
    assert str(tmp_path / 'user') in why
    assert 'set NUMBA_CACHE_DIR' in why
    assert '\n' not in why


class Payload:
    """What an attacker leaves where numba unpickles: it makes a file."""

    def __init__(self, mark: Path) -> None:
        self.mark = mark

    def __reduce__(self):
        return os.mkdir, (str(self.mark),)


def _call_anew() -> float:
    return entry_point(twice)(1.5)


def test_what_another_user_has_put_into_a_cache_is_not_executed(package, tmp_path, monkeypatch):
    monkeypatch.setattr(kernel_cache, 'cache_folders', fresh_folders)
    mark, folder = tmp_path / 'executed', fresh_folders().write
    assert _call_anew() == 3.0
    [kept] = folder.glob(KEPT)
    kernel_cache.save_whole(kept, pickle.dumps(Payload(mark)))
    folder.chmod(0o777)
    assert _call_anew() == 3.0
    assert not mark.exists()

    # The payload works: where only this user can have put it, it is executed.
    folder.chmod(0o700)
    assert _call_anew() == 3.0
    assert mark.exists()


def test_signatures_that_are_compiled_at_once_each_find_their_own_code(package, monkeypatch):
    monkeypatch.setattr(kernel_cache, 'cache_folders', fresh_folders)
    both = Barrier(2)

    def compile_and_load(value: float) -> list[float]:
        both.wait()
        return [entry_point(twice)(value) for _ in range(2)]

    with ThreadPoolExecutor(2) as threads:
        assert repr([*threads.map(compile_and_load, (1.5, 1))]) == '[[3.0, 3.0], [2.0, 2.0]]'
    assert len([*fresh_folders().write.glob(KEPT)]) == 2


def test_of_two_that_keep_a_file_at_once_one_is_found_whole(tmp_path):
    both, kept = Barrier(2), tmp_path / 'kernel.nbc'

    def keep(data: bytes) -> list[bytes]:
        found = []
        for _ in range(ROUNDS):
            both.wait()
            kernel_cache.save_whole(kept, data)
            found.append(kernel_cache.load_whole(kept))
        return found

    own = (b'one' * 9999, b'another' * 9999)
    with ThreadPoolExecutor(2) as threads:
        found = {*chain.from_iterable(threads.map(keep, own))}
    assert found <= {*own}
    assert [*tmp_path.iterdir()] == [kept]


def empty(file: Path) -> None:
    file.write_bytes(b'')


def cut(file: Path) -> None:
    os.truncate(file, file.stat().st_size // 2)


def flip(file: Path) -> None:
    data = bytearray(file.read_bytes())
    data[random.Random(file.name).randrange(len(data))] ^= 1 << random.Random(0).randrange(8)
    file.write_bytes(data)


def rename_another(file: Path) -> None:
    """Put the machine code of another kernel there, which takes other arguments."""
    others = [each for each in file.parent.glob('*.nbc') if each != file]
    file.write_bytes(others[0].read_bytes())


def keep_garbage(file: Path) -> None:
    kernel_cache.save_whole(file, random.Random(file.name).randbytes(1000))


def keep_another_thing(file: Path) -> None:
    kernel_cache.save_whole(file, pickle.dumps({'machine': 'code'}))


DAMAGES = (empty, cut, flip, rename_another, keep_garbage, keep_another_thing)


@pytest.mark.parametrize('damage', DAMAGES)
def test_a_damaged_kernel_is_compiled_anew_and_kept_and_one_line_says_so(
    damage, package, monkeypatch, caplog
):
    monkeypatch.setattr(kernel_cache, 'cache_folders', fresh_folders)
    monkeypatch.setattr(kernel_cache.KernelCache, '_has_warned', False)
    assert _call_anew() == entry_point(thrice)(1.0) == 3.0
    kept = sorted(fresh_folders().write.glob('*.nbc'))
    for file in kept:
        damage(file)
    assert _call_anew() == entry_point(thrice)(1.0) == 3.0
    [line] = caplog.messages
    assert line.startswith('compiled kernel ')
    assert line.endswith('; it is compiled anew, with others like it')
    assert sorted(fresh_folders().write.glob('*.nbc')) == kept
    again: Any = entry_point(twice)
    assert again(1.5) == 3.0
    assert sum(again.stats.cache_hits.values()) == 1


BRING = """
import little
from stickslip_ros.kernels.kernel import entry_point
assert entry_point(little.half)(3.0) == 1.5
"""
FOR_OTHERS = {'NUMBA_CPU_NAME': kernel_cache.PORTABLE_CPU, 'NUMBA_CPU_FEATURES': ''}
HAS_ALL = {*get_host_cpu_features().flatten().split(',')} >= kernel_cache.PORTABLE_FEATURES


@pytest.fixture(scope='module')
def compiled_for_others(tmp_path_factory) -> Path:
    """Give a folder with a function and what it is on another processor."""
    place = tmp_path_factory.mktemp('wheel')
    (place / 'little.py').write_text('def half(x):\n    return 0.5 * x\n')
    environment = os.environ | FOR_OTHERS | {'NUMBA_CACHE_DIR': str(place / 'made')}
    run_process([sys.executable, '-c', BRING], cwd=place, env=environment, check=True)
    return place


@pytest.fixture
def bundled(package, compiled_for_others, monkeypatch) -> Path:
    """Give the folder in which a wheel brings it."""
    monkeypatch.setattr(kernel_cache, 'cache_folders', fresh_folders)
    monkeypatch.syspath_prepend(compiled_for_others)
    [made] = (compiled_for_others / 'made').iterdir()
    return shutil.copytree(made, package / 'kernels' / fresh_folders().write.name)


def _is_brought() -> bool:
    half: Any = entry_point(importlib.import_module('little').half)
    assert half(3.0) == 1.5
    return bool(half.stats.cache_hits)


@pytest.mark.skipif(not HAS_ALL, reason=f'this processor is older than {FOR_OTHERS}')
def test_what_a_wheel_brings_is_loaded_and_not_compiled_again(bundled):
    assert _is_brought()
    assert fresh_folders().bundled == bundled
    assert not [*fresh_folders().write.iterdir()]


def _age(package: Path, bundled: Path, patch: pytest.MonkeyPatch) -> None:
    (package / 'drive/short_step.py').write_text('another_version = True\n')


def _upgrade(package: Path, bundled: Path, patch: pytest.MonkeyPatch) -> None:
    patch.setattr(numba, '__version__', '1.0.0')


def _ask_for_another(package: Path, bundled: Path, patch: pytest.MonkeyPatch) -> None:
    patch.setattr(kernel_cache, 'PORTABLE_FEATURES', frozenset({'+vector_unit_of_tomorrow'}))


@pytest.mark.parametrize('change', [_age, _upgrade, _ask_for_another])
def test_what_was_brought_for_others_is_left(change, package, bundled, monkeypatch):
    change(package, bundled, monkeypatch)
    assert not _is_brought()


def test_python_cannot_call_a_kernel_of_kernels_by_mistake():
    assert entry_point(thrice)(1.5) == in_python(thrice)(1.5) == 4.5
    with pytest.raises(TypeError, match=r'thrice .* other kernels only; call entry_point'):
        thrice(1.5)


LOAD = """
import sys
import numba
import numpy
from stickslip_ros.instrument.compilation import compile_kernels
compile_kernels()
print('numba.np.arraymath' in sys.modules)
print(numba.njit(lambda values: values.sum())(numpy.ones(3)))
"""


@pytest.mark.usefixtures('compiled_kernels')
def test_kept_kernels_are_loaded_without_what_numba_compiles_with():
    ended = run_process([sys.executable, '-c', LOAD], check=True)
    assert ended.stdout == 'False\n3.0\n'
