# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Options of ``fit`` and ``compare`` for reading and running experiments."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from stickslip_ros.lab.measurements.table_options import TableOptions
from stickslip_ros.lab.measurements.vocabulary import MeasuredTable
from stickslip_ros.parameters import Parameters, ReplaceableDefault

if TYPE_CHECKING:
    from stickslip_ros.lab.readers.formats import Table


@dataclass(frozen=True, kw_only=True)
class ReadingOptions:
    """Options for reading and running experiments."""

    headers: Mapping[str, str] = field(default_factory=dict)
    """
    Column of each quantity in a table, or topic and field in a recording, with the unit.

    For example ``{'force_n': 'Force (mN)'}`` or ``{'position_m': '/rig/encoder.point.x'}``.

    """
    preloads_n: Sequence[float] = ()
    """Preload of files without a preload column, N: one value for all, or one for each."""
    rate_hz: float | None = None
    """Rows per second of evenly spaced tables; replaces columns of times."""
    commands: 'Table | None' = None
    """Table of the times and voltages that drove the recordings."""
    window_s: tuple[float, float] | None = None
    """Start and end of the part to use, s."""
    load_n: float = 0.0
    """Constant force on the runner along +x, added to that of a recording or column, N."""
    slope_deg: float = 0.0
    """Slope of the rail, degrees; above 0 the runner climbs towards +x, against its weight."""
    frequency_hz: float = 1000.0
    """Steps per second of points without a frequency, Hz."""
    steps: int = 0
    """Steps from rest before the numbers are read; 0 waits for the steady state."""
    workers: int = 0
    """Threads; 0: one per core."""

    def reading(
        self, report: Callable[[MeasuredTable], None] | None, stand: Parameters | None
    ) -> TableOptions:
        """Return the options for tables, with the preload of ``stand`` if it was set."""
        own_n = None if stand is None else stand.stand.preload
        given_n = None if isinstance(own_n, ReplaceableDefault) else own_n
        given = self.headers, self.preloads_n, report, stand is not None, given_n
        return TableOptions(*given, rate_hz=self.rate_hz)
