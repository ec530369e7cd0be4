"""The worked example of the README: its commands are run, as they stand there."""

import re
import shlex
from pathlib import Path

import pytest

from stickslip_ros.cli.main import main

ROOT = Path(__file__).resolve().parents[1]
HEADING = '## From a recording to a report'


def example() -> list[list[str]]:
    """Return the commands of the example, word by word."""
    section = (ROOT / 'README.md').read_text(encoding='utf-8').partition(HEADING)[2]
    block = re.search(r'```sh\n(.*?)```', section, re.DOTALL)
    assert block is not None
    return [shlex.split(line, comments=True) for line in block.group(1).splitlines() if line]


def test_the_example_runs_as_it_stands(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.chdir(tmp_path)
    commands = example()
    assert len(commands) >= 8
    for program, *words in commands:
        assert program == 'stickslip'
        assert main(words) == 0, words
    written = {path.name for path in (tmp_path / 'runs').iterdir()}
    assert written >= {'damped.mcap', 'damping.html', 'damped.png', 'roughness.html'}


@pytest.mark.parametrize('page', sorted(ROOT.glob('*.md')) + sorted((ROOT / 'docs').glob('*.md')))
def test_every_link_into_the_repository_leads_somewhere(page: Path):
    text = page.read_text(encoding='utf-8')
    links = [link for link in re.findall(r'\]\(([^)#]+)(?:#[^)]*)?\)', text) if '://' not in link]
    assert [link for link in links if not (page.parent / link).exists()] == []
