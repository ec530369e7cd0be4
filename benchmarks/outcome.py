# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The result of a benchmark: rows and notes."""

from dataclasses import dataclass, field

import numpy as np

from stickslip_ros.arrays import Array

Row = dict[str, str | float]


@dataclass(frozen=True)
class Outcome:
    """The table of one benchmark: rows with the same keys, and what the reader must know."""

    title: str
    rows: list[Row]
    notes: list[str] = field(default_factory=list)


def spread(name: str, ratios: Array, low: str = 'lowest', high: str = 'highest') -> Row:
    """Return median, least and largest of some ratios as entries of a row."""
    return {
        name: float(np.median(ratios)),
        low: float(np.min(ratios)),
        high: float(np.max(ratios)),
    }
