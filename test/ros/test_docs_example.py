"""The example in docs/testing.md, as it stands there, is collected by pytest and passes."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

PAGE = Path(__file__).parents[2] / 'docs' / 'testing.md'
TIMEOUT_S = 120.0


@pytest.fixture
def project(tmp_path: Path) -> Path:
    """Write the two Python blocks of the page into the files that it names."""
    conftest, tests = re.findall(
        r'^```python\n(.*?)^```', PAGE.read_text(), re.DOTALL | re.MULTILINE
    )
    (tmp_path / 'conftest.py').write_text(conftest)
    (tmp_path / 'test_controller.py').write_text(tests)
    return tmp_path


def run_pytest(project: Path) -> str:
    """Run the tests of a project in a process of their own; give the last line."""
    command = [sys.executable, '-m', 'pytest', '-q', '-p', 'no:cacheprovider', str(project)]
    done = subprocess.run(
        command, cwd=project, capture_output=True, text=True, timeout=TIMEOUT_S, check=False
    )
    return done.stdout.splitlines()[-1]


def test_the_example_of_the_page_passes(project: Path):
    assert run_pytest(project).startswith('2 passed')


def test_the_example_of_the_page_fails_where_its_controller_cannot_reach_the_target(
    project: Path,
):
    tests = project / 'test_controller.py'
    below_0_v = tests.read_text().replace('TARGET_M = 40e-9', 'TARGET_M = -40e-9')
    tests.write_text(below_0_v)
    assert run_pytest(project).startswith('1 failed, 1 passed')
