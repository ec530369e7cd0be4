# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Arguments are read by their types: an alias is the type that it stands for."""

from collections.abc import Callable, Sequence
from functools import reduce
from operator import or_
from typing import Any, Literal

import numpy as np
import pytest
from numpy.typing import ArrayLike
from typing_extensions import TypeAliasType

from stickslip_ros.errors import WrongKind
from stickslip_ros.parameters.arguments import checked_arguments

ALIAS: Any = TypeAliasType('ALIAS', ArrayLike)
"""What ArrayLike is from numpy 2.5 on; before, it is the union itself."""


def function(annotation: Any) -> Callable[..., Any]:
    """Return a function that gives back its argument, of this type."""

    def identity(value_v: Any = None) -> Any:
        return value_v

    identity.__annotations__['value_v'] = annotation
    return checked_arguments(identity)


@pytest.mark.parametrize('numbers', [ArrayLike, ALIAS], ids=['union', 'alias'])
@pytest.mark.parametrize('others', [(), (None,), (None, str)], ids=str)
def test_numbers_are_read_whether_numpy_calls_them_a_union_or_an_alias(
    numbers: Any, others: tuple[Any, ...], monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setattr('numpy.typing.ArrayLike', numbers)
    identity = function(reduce(or_, others, numbers))
    assert identity(['1mV', 2.0]) == [1e-3, 2.0]
    assert identity(np.array([[1.0, 2.0]])) == [[1.0, 2.0]]
    with pytest.raises(WrongKind, match=r'value_v <\w+>|value_v'):
        identity({'a': 1.0})


@pytest.mark.parametrize(
    'annotation', [Literal['a', 'b'], 'Table | None', list[int] | Literal[3], Any], ids=str
)
def test_a_type_that_no_value_can_be_compared_with_takes_every_value(annotation: Any):
    assert function(annotation)(7) == 7


def test_an_alias_of_a_class_and_a_union_by_its_old_name_are_what_they_stand_for():
    path: Any = TypeAliasType('path', str | None)
    assert function(path | None)('a') == 'a'
    with pytest.raises(WrongKind):
        function(dict | bytes)(7)
    assert function(Sequence[float])('2mV') == (2e-3,)
