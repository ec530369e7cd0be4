# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""A shell asks what may come next, as bash does with the line that the page of the verbs gives."""

import os
import shutil
import sys
from pathlib import Path

import pytest
from processes import run_process

BIN = Path(sys.executable).parent
IMPORTED = """
import os, sys
left = os._exit
def leave(status):
    found = [each for each in SLOW if each in sys.modules]
    print('imported', found, file=sys.stderr, flush=True)
    left(status)
os._exit = leave
from stickslip_ros.lab.cli.start import stickslip
stickslip()
"""
ASK = """
eval "$(register-python-argcomplete stickslip)"
for line; do
    COMP_LINE="$line" COMP_POINT=${#line} COMP_TYPE=9 COMPREPLY=()
    _python_argcomplete stickslip
    printf '%s ' "${COMPREPLY[@]}"
    echo
done
"""
OFFERED = {
    'stickslip zero': {'zero-amplitude'},
    'stickslip zero-amplitude --f': {'--frequency'},
    'stickslip info ': {'run.mcap', 'there/'},
    'stickslip fit a.csv -o ': {'run.mcap', 'there/'},
    'stickslip simulate --amplitude ': set[str](),
    'stickslip simulate --stage r': {'rod'},
    'stickslip simulate --set stand.preload_r': {'stand.preload_rate='},
    'stickslip simulate --set contact.profile=s': {'smooth'},
    'stickslip fit a.csv --free runner.mass,runner.d': {'runner.mass,runner.damping'},
}
"""What bash shall offer for a line, beside options that may follow as well."""


def test_bash_completes_verbs_options_files_and_parameters(tmp_path: Path):
    (tmp_path / 'run.mcap').touch()
    (tmp_path / 'there').mkdir()
    told = run_process(
        ['bash', '-c', ASK, 'bash', *OFFERED],
        cwd=tmp_path,
        env={**os.environ, 'PATH': f'{BIN}:{os.environ["PATH"]}'},
        check=True,
    )
    for (line, offered), words in zip(OFFERED.items(), told.stdout.splitlines(), strict=True):
        others = {word for word in words.split() if not word.startswith('--')}
        assert others | offered & set(words.split()) == offered, line


@pytest.mark.parametrize('line', ['stickslip s', 'stickslip fit --', 'stickslip drive --set st'])
def test_completion_imports_nothing_that_takes_long(line: str, tmp_path: Path):
    slow = ('numba', 'scipy', 'matplotlib', 'rich', 'numpy', 'rclpy')
    told = run_process(
        [sys.executable, '-c', f'SLOW = {slow}\n{IMPORTED}'],
        env={
            **os.environ,
            '_ARGCOMPLETE': '1',
            '_ARGCOMPLETE_STDOUT_FILENAME': str(tmp_path / 'told'),
            'COMP_LINE': line,
            'COMP_POINT': str(len(line)),
        },
        check=True,
    )
    assert told.stderr.endswith('imported []\n')
    assert (tmp_path / 'told').read_text()


def test_the_line_of_the_page_is_what_was_tried():
    assert shutil.which('register-python-argcomplete', path=str(BIN))
    page = (Path(__file__).parents[3] / 'docs/reference/verbs.md').read_text(encoding='utf-8')
    assert ASK.splitlines()[1] in page
