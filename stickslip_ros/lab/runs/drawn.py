"""Results that draw themselves, as wide as a screen or a journal wants them."""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from matplotlib.figure import Figure


class Drawn:
    """A result with a figure."""

    def plot(self, *, style: str = '', width_mm: float | None = None) -> 'Figure':
        """
        Draw it.

        The style is ``screen``, ``paper`` or a style file of matplotlib; a width alone means
        paper, where a column has 85 mm, with letters of 8 pt.

        """
        from stickslip_ros.lab.runs.plotting import looking  # noqa: PLC0415 - takes long

        with looking(style, width_mm):
            return self._draw()

    def _draw(self) -> 'Figure':
        raise NotImplementedError
