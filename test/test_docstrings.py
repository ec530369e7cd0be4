# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Examples in docstrings of public names give what they say."""

import doctest

import pytest

import stickslip_ros

FINDER = doctest.DocTestFinder(recurse=False)
NAMES = {name: getattr(stickslip_ros, name) for name in dir(stickslip_ros) if name[0] != '_'}
EXAMPLES = {
    name: test
    for name, public in NAMES.items()
    for test in FINDER.find(public, name, globs=dict(NAMES))
    if test.examples
}


@pytest.mark.parametrize('name', EXAMPLES)
def test_an_example_gives_what_it_says(name: str, capsys: pytest.CaptureFixture[str]):
    failed, tried = doctest.DocTestRunner().run(EXAMPLES[name])
    assert (failed, tried) == (0, len(EXAMPLES[name].examples)), capsys.readouterr().out


def test_most_of_what_computes_has_an_example():
    assert {'simulate', 'run_drive', 'sweep', 'presliding', 'linearise', 'Bench'} <= {*EXAMPLES}
