# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The result of a benchmark: rows and notes."""

from dataclasses import dataclass, field

Row = dict[str, str | float]


@dataclass(frozen=True)
class Outcome:
    """The table of one benchmark: rows with the same keys, and what the reader must know."""

    title: str
    rows: list[Row]
    notes: list[str] = field(default_factory=list)
