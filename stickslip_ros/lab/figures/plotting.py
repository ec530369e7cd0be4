# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Figures of the package: style, size, labels, files."""

import io
import itertools
import math
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path
from typing import Any, Final

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure, SubFigure
from matplotlib.lines import Line2D
from matplotlib.text import Annotation

from stickslip_ros.arrays import Array
from stickslip_ros.errors import UnknownName
from stickslip_ros.files import read_text, replacing
from stickslip_ros.parameters import Spec

UNDATED: Final[Mapping[str, Mapping[str, Any]]] = {
    '.png': {},
    '.svg': {'Date': None},
    '.pdf': {'CreationDate': None},
}
"""Picture formats, and metadata that removes the date."""
BLUE, VERMILION, GREEN, PURPLE, ORANGE, SKY_BLUE, BLACK = (f'C{number}' for number in range(7))
"""Colours of screen.mplstyle, in order."""
GREY: Final = '0.4'
NARROW_INCHES: Final = 5.0  # narrower figures have fewer and shorter labels
_WIDTH: Final = Spec(float, 85.0, 'mm', '', 'width of a figure', 40.0, 500.0)
_style: ContextVar[dict[str, Any] | None] = ContextVar('style', default=None)


def style_of(style: str = '', width_mm: float | None = None) -> dict[str, Any]:
    """
    Return the matplotlib settings of ``screen``, ``paper`` or a style file (based on paper).

    A width without a style means paper; without a width, the size comes from the style or figure.

    """
    name = style or ('screen' if width_mm is None else 'paper')
    files = [Path(__file__).with_name('screen.mplstyle')]
    if name != 'screen':
        files.append(files[0].with_name('paper.mplstyle'))
    if name.endswith('.mplstyle'):
        read_text(Path(name), 'give a style file of matplotlib', 'save it as UTF-8')
        files.append(Path(name))
    elif name not in {'screen', 'paper'}:
        raise UnknownName('style', name, 'use screen, paper or a file NAME.mplstyle')
    settings: dict[str, Any] = {}
    for file in files:
        settings |= mpl.rc_params_from_file(file, use_default_template=False)
    if width_mm is not None:
        _WIDTH.check(_WIDTH.text, width_mm)
        settings['figure.figsize'] = width_mm / 25.4, 1.0
    return settings


@contextmanager
def looking(style: str = '', width_mm: float | None = None) -> Iterator[None]:
    """Set style and width of the figures drawn in this context."""
    before = _style.set(style_of(style, width_mm))
    try:
        yield
    finally:
        _style.reset(before)


@contextmanager
def styled() -> Iterator[None]:
    """Draw in the current style, as a context or decorator."""
    with mpl.rc_context(_style.get() or style_of()):
        yield


class StyledFigure(Figure):
    """A figure that keeps its style, as matplotlib creates some text when it draws."""

    def __init__(self, style: dict[str, Any], **how: Any) -> None:
        self._style = style
        super().__init__(**how)

    def draw(self, renderer: Any) -> None:
        """Draw in the own style."""
        with mpl.rc_context(self._style):
            super().draw(renderer)

    def savefig(self, *where: Any, **how: Any) -> None:
        """Write in the own style."""
        with mpl.rc_context(self._style):
            super().savefig(*where, **how)

    def _repr_png_(self) -> bytes:
        """Show itself in a notebook, as pyplot, which shows others, does not know it."""
        file = io.BytesIO()
        self.savefig(file, format='png')
        return file.getvalue()


def new_figure(width_inches: float, height_inches: float, title: str = '') -> Figure:
    """Return an empty figure with constrained layout."""
    style = _style.get() or style_of()
    if 'figure.figsize' in style:
        ratio = style['figure.figsize'][0] / width_inches
        # The height scales with the root, as text shrinks less than the figure.
        width_inches, height_inches = ratio * width_inches, math.sqrt(ratio) * height_inches
    figure = StyledFigure(style, figsize=(width_inches, height_inches), layout='constrained')
    if title:
        figure.suptitle(title)
    return figure


def is_narrow(figure: Figure | SubFigure) -> bool:
    """Return whether a figure has little room for text."""
    return bool(figure.bbox.width < NARROW_INCHES * figure.dpi)


def curve_style(number: int) -> dict[str, Any]:
    """Return colour and dashes of the curve with this number, for ``plot``."""
    styles: list[dict[str, Any]] = list(mpl.rcParams['axes.prop_cycle'])
    return styles[number % len(styles)]


def escaped(text: str) -> str:
    """Escape a text such as a file name, so that matplotlib sees no formula."""
    return text.replace('$', r'\$')


def label_end(axes: Axes, line: Line2D, text: str) -> None:
    """Write a text to the right of the end of a curve, in its colour."""
    x, y = np.asarray(line.get_xydata())[-1]
    write_label(axes, x, y, text, color=line.get_color(), annotation_clip=False)


def write_label(
    axes: Axes, x: float, y: float, text: str, *, left: bool = False, **style: Any
) -> Annotation:
    """Write a text to the right or left of a point; return it."""
    place = {'xytext': (-4, 0), 'ha': 'right'} if left else {'xytext': (4, 0)}
    return axes.annotate(text, (x, y), textcoords='offset points', va='center', **place, **style)


def check_picture(path: Path) -> None:
    """Refuse a picture that is not PNG, SVG or PDF."""
    if path.suffix.lower() not in UNDATED:
        raise UnknownName('kind of picture', path.suffix, f'use {", ".join(UNDATED)}')


def save_figure(figure: Figure, picture: Path) -> None:
    """Write a figure as PNG, SVG or PDF, the same bytes for the same numbers."""
    check_picture(picture)
    kind = picture.suffix.lower()
    with replacing(picture) as part:
        figure.savefig(part, format=kind[1:], metadata=dict(UNDATED[kind]))


def svg_of(figure: Figure) -> str:
    """Return a figure as SVG, the same text for the same numbers."""
    text = io.StringIO()
    figure.savefig(text, format='svg', metadata=dict(UNDATED['.svg']))
    return text.getvalue()


def decimated(x: Array, y: Array, pixels: int) -> tuple[Array, Array]:
    """Return the samples that a curve needs at this width; peaks and gaps are kept."""
    if len(x) <= 4 * pixels:
        return x, y
    width = (x[-1] - x[0]) / pixels
    edges = np.searchsorted(x, x[0] + width * np.arange(pixels), 'left')
    starts = np.unique(np.append(edges, len(x)))
    kept: list[int] = []
    for first, last in itertools.pairwise(starts.tolist()):
        kept += sorted({first, last - 1, *(first + each for each in _peaks(y[first:last]))})
    return x[kept], y[kept]


def _peaks(values: Array) -> list[int]:
    """Return the places of smallest and largest finite value, and of the first gap."""
    ends = [int(values.argmin()), int(values.argmax())]
    if np.isfinite(values[ends]).all():  # a gap would be an end
        return ends
    is_finite = np.isfinite(values)
    finite, gaps = np.flatnonzero(is_finite), np.flatnonzero(~is_finite)
    known = values[finite]
    ends = [int(known.argmin()), int(known.argmax())] if len(finite) else []
    return [*finite[ends].tolist(), int(gaps[0])]
