"""The test in docs/testing_a_controller.md, as it stands there, is collected and passes."""

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

PAGE = Path(__file__).parents[2] / 'docs' / 'testing_a_controller.md'


def example() -> dict[str, Any]:
    """Execute the only Python block of the page as a module of its own; give its names."""
    [source] = re.findall(r'^```python\n(.*?)^```', PAGE.read_text(), re.DOTALL | re.MULTILINE)
    names: dict[str, Any] = {'__name__': 'test_controller'}
    exec(compile(source, str(PAGE), 'exec'), names)
    return names


def found_in(names: dict[str, Any]) -> list[Callable[[], None]]:
    return [value for name, value in names.items() if name.startswith('test_')]


def test_the_example_of_the_page_passes():
    [test] = found_in(example())
    test()


def test_the_example_of_the_page_fails_where_its_controller_cannot_reach_the_target():
    names = example()
    names['TARGET_M'] = -40e-9  # below what 0 V gives
    [test] = found_in(names)
    with pytest.raises(AssertionError):
        test()
