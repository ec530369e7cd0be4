# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Results with a figure and a page."""

# ruff: noqa: PLC0415 - matplotlib is slow to import

from pathlib import Path
from typing import TYPE_CHECKING

from stickslip_ros.files import PAGE_ENDINGS, prepare_output, replacing
from stickslip_ros.parameters import checked_arguments
from stickslip_ros.sections import NotebookView

if TYPE_CHECKING:
    from matplotlib.figure import Figure


class Plottable(NotebookView):
    """A result with a figure."""

    @checked_arguments
    def plot(self, *, style: str = '', width_mm: float | None = None) -> 'Figure':
        """
        Draw the result.

        The style is ``screen``, ``paper`` or a style file of matplotlib; a width alone means
        paper, where a column is 85 mm wide, with 8 pt text.

        """
        from stickslip_ros.lab.figures.plotting import looking

        with looking(style, width_mm):
            return self._draw()

    @checked_arguments
    def save(self, path: str | Path, command: str = '') -> Path:
        """
        Write a self-contained page of HTML, with the ``command`` if given; replace an old page.

        Raises
        ------
        RecordingError
            If it cannot be written.

        """
        from stickslip_ros.lab.figures.page import page_of

        prepare_output(Path(path), endings=PAGE_ENDINGS)
        with replacing(Path(path)) as part:
            part.write_text(page_of(self.sections(), command), encoding='utf-8')
        return Path(path)

    def _draw(self) -> 'Figure':
        raise NotImplementedError
