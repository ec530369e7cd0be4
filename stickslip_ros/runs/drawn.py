"""Results that draw themselves, as wide as a screen or a journal wants them."""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from matplotlib.figure import Figure


class Drawn:
    """A result with a figure."""

    def plot(self, *, width_mm: float | None = None, font_pt: float | None = None) -> 'Figure':
        """Draw it; with a width as a journal prints it, 85 mm a column, in letters of 8 pt."""
        from stickslip_ros.runs.plotting import look_of, looking  # noqa: PLC0415 - takes long

        with looking(look_of(width_mm=width_mm, font_pt=font_pt)):
            return self._draw()

    def _draw(self) -> 'Figure':
        raise NotImplementedError
