# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Vocabulary of the readers, given by the caller: quantities, units, limits, names."""

from collections.abc import Callable, Mapping, Sequence, Set
from dataclasses import dataclass, field
from typing import Any

CLOCK_QUANTITY = 'time_s'
"""The clock of the other quantities."""


@dataclass(frozen=True)
class Vocabulary:
    """Quantities that a table may hold."""

    quantities: Mapping[str, Any]  # spec by name: unit (SI), text, minimum, maximum
    recognise: Callable[[str, str], str | None]  # quantity of a header's name and unit
    conditions: Set[str]  # quantities read even if the user names columns
    sigmas: Mapping[str, str]  # quantity by uncertainty
    needed: Mapping[str, Sequence[str]] = field(default_factory=dict)  # settings by quantity
    words: Mapping[str, Callable[[str], str]] = field(default_factory=dict)  # words to numbers

    def of(self, name: str) -> str:
        """Return the quantity of an uncertainty, or the quantity itself."""
        return self.sigmas.get(name, name)
