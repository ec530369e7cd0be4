"""Figures of the package: how one begins, how its axes look, and how it becomes a file."""

import io
import itertools
from collections.abc import Mapping
from pathlib import Path
from typing import IO, Any, Final

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from stickslip_ros.contact.profile import Array
from stickslip_ros.errors import RecordingError, UnknownName

DOTS_PER_INCH: Final = 120
UNDATED: Final[Mapping[str, Mapping[str, Any]]] = {
    '.png': {},
    '.svg': {'Date': None},
    '.pdf': {'CreationDate': None},
}
"""Kinds of picture, and the metadata without which a kind has the time in it."""
SAME_NAMES: Final = {'svg.hashsalt': 'stickslip'}
"""Without it matplotlib names the parts of an SVG at random."""


def new_figure(width_inches: float, height_inches: float, title: str = '') -> Figure:
    """Return an empty figure whose axes make room for their labels."""
    figure = Figure(figsize=(width_inches, height_inches), layout='constrained')
    if title:
        figure.suptitle(title)
    return figure


def label_axes(axes: Axes, x_label: str, y_label: str, title: str = '') -> None:
    """Give axes labels, a title and a grid."""
    axes.set_xlabel(x_label)
    axes.set_ylabel(y_label)
    axes.set_title(title, fontsize='medium')
    axes.grid(visible=True, alpha=0.3)


def check_picture(path: Path) -> None:
    """
    Refuse a picture of a kind that cannot be drawn.

    Raises
    ------
    UnknownName
        If it is neither PNG nor SVG nor PDF.

    """
    if path.suffix.lower() not in UNDATED:
        raise UnknownName('kind of picture', path.suffix, f'use {", ".join(UNDATED)}')


def save_figure(figure: Figure, picture: Path) -> None:
    """
    Write a figure as PNG, SVG or PDF, the same bytes for the same numbers; folders are made.

    Raises
    ------
    UnknownName
        If it is to be of another kind.
    RecordingError
        If it cannot be written.

    """
    check_picture(picture)
    try:
        picture.parent.mkdir(parents=True, exist_ok=True)
        _save(figure, picture, picture.suffix.lower())
    except OSError as error:
        problem = f'cannot be written ({error.strerror})'
        raise RecordingError(picture, problem, 'choose another place') from None


def svg_of(figure: Figure) -> str:
    """Return a figure as SVG, the same text for the same numbers."""
    text = io.StringIO()
    _save(figure, text, '.svg')
    return text.getvalue()


def _save(figure: Figure, file: Path | IO[str], suffix: str) -> None:
    with mpl.rc_context(SAME_NAMES):
        metadata = dict(UNDATED[suffix])
        figure.savefig(file, format=suffix[1:], dpi=DOTS_PER_INCH, metadata=metadata)


def decimated(x: Array, y: Array, pixels: int) -> tuple[Array, Array]:
    """
    Return the samples that a curve of so many pixels needs, such that no peak is lost.

    Parameters
    ----------
    x : array, shape (n,)
        Rising.
    y : array, shape (n,)
        May hold what is not a number; such samples stay, as gaps.
    pixels : int
        Width of the picture.

    Returns
    -------
    x, y : array, shape (m,)
        All samples if there are at most four per pixel; else first, lowest, highest and last of
        each pixel, in their order.

    """
    if len(x) <= 4 * pixels:
        return x, y
    width = (x[-1] - x[0]) / pixels
    edges = np.searchsorted(x, x[0] + width * np.arange(pixels), 'left')
    starts = np.unique(np.append(edges, len(x)))
    kept = [
        index
        for first, last in itertools.pairwise(starts)
        for index in _extremes(y[first:last], int(first))
    ]
    return x[kept], y[kept]


def _extremes(values: Array, first: int) -> list[int]:
    finite = np.flatnonzero(np.isfinite(values))
    chosen = {0, len(values) - 1}
    if len(finite):
        chosen |= {int(finite[values[finite].argmin()]), int(finite[values[finite].argmax()])}
    if len(finite) < len(values):
        chosen.add(int(np.flatnonzero(~np.isfinite(values))[0]))
    return sorted(first + index for index in chosen)
