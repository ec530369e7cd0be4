# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The report of a comparison: its text and its figure."""

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from stickslip_ros.lab.comparison.result import Compared, Comparison
from stickslip_ros.lab.comparison.words import sections, sentences
from stickslip_ros.lab.figures.plottable import Plottable
from stickslip_ros.sections import Section

if TYPE_CHECKING:
    from matplotlib.figure import Figure


class ComparisonReport(Plottable, Comparison):
    """The result of ``compare``."""

    def sections(self) -> Iterator[Section]:
        """Yield the findings, the two sides, and the numbers of each quantity."""
        return sections(self, self._draw)

    def _draw(self, quantities: Sequence[Compared] = ()) -> 'Figure':
        # It takes long.
        from stickslip_ros.lab.comparison.figure import draw_comparison  # noqa: PLC0415

        return draw_comparison(self, quantities or self.quantities)

    def __repr__(self) -> str:
        return '\n'.join(sentences(self))
