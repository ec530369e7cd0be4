# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The result of a benchmark: rows, targets, notes."""

from dataclasses import dataclass, field

Row = dict[str, str | float]


@dataclass(frozen=True)
class Verdict:
    """A target in words, what was wanted at least, or at most, and what was found."""

    target: str
    wanted: float
    found: float
    at_most: bool = False

    @property
    def met(self) -> bool:
        """Return whether the target was reached."""
        return self.found <= self.wanted if self.at_most else self.found >= self.wanted


@dataclass(frozen=True)
class Outcome:
    """The table of one benchmark: rows with the same keys, targets, what the reader must know."""

    title: str
    rows: list[Row]
    verdicts: list[Verdict] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
