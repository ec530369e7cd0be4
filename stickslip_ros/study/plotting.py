"""What the pictures of the package share."""

from typing import Final

from matplotlib.axes import Axes

SAME_BYTES: Final = {'svg.hashsalt': 'stickslip'}
"""Without it matplotlib names the parts of an SVG at random."""


def dress(axes: Axes, x_label: str, y_label: str, title: str = '') -> None:
    """Give axes labels, a title and a grid."""
    axes.set_xlabel(x_label)
    axes.set_ylabel(y_label)
    axes.set_title(title, fontsize='medium')
    axes.grid(visible=True, alpha=0.3)
