"""The test in docs/testing_a_controller.md, as it stands there, is collected and passes."""

import re
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

PAGE = Path(__file__).parents[2] / 'docs' / 'testing_a_controller.md'


@pytest.fixture
def names(domain: int) -> dict[str, Any]:
    """Execute the only Python block of the page as a module of its own; give its names."""
    [source] = re.findall(r'^```python\n(.*?)^```', PAGE.read_text(), re.DOTALL | re.MULTILINE)
    names: dict[str, Any] = {'__name__': 'test_controller'}
    exec(compile(source, str(PAGE), 'exec'), names)
    names['os'] = SimpleNamespace(getpid=lambda: domain - 1)  # which makes it our own domain
    return names


def found_in(names: dict[str, Any]) -> list[Callable[[], None]]:
    return [value for name, value in names.items() if name.startswith('test_')]


def test_the_example_of_the_page_passes(names: dict[str, Any]):
    [test] = found_in(names)
    test()


def test_the_example_of_the_page_fails_where_its_controller_cannot_reach_the_target(
    names: dict[str, Any],
):
    names['TARGET_M'] = -40e-9  # below what 0 V gives
    [test] = found_in(names)
    with pytest.raises(AssertionError):
        test()
