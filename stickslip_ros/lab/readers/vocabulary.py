# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The vocabulary that a caller hands to the readers: quantities, their units, limits and names."""

from collections.abc import Callable, Mapping, Sequence, Set
from dataclasses import dataclass, field
from typing import Any

CLOCK_QUANTITY = 'time_s'
"""The quantity that is the clock of others."""


@dataclass(frozen=True)
class Vocabulary:
    """Quantities that a table may hold."""

    quantities: Mapping[str, Any]  # unit (SI), text, minimum and maximum of each
    recognise: Callable[[str, str], str | None]  # quantity of a header's name and unit
    conditions: Set[str]  # read even if the user names columns
    sigmas: Mapping[str, str]  # uncertainties, and the quantity of each
    needed: Mapping[str, Sequence[str]] = field(default_factory=dict)  # in a row, by quantity
    words: Mapping[str, Callable[[str], str]] = field(default_factory=dict)  # words to numbers

    def of(self, name: str) -> str:
        """Return the quantity of an uncertainty, or the quantity itself."""
        return self.sigmas.get(name, name)
