"""Figures of the package: how one begins, how its curves and axes look, how it becomes a file."""

import io
import itertools
import math
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path
from typing import IO, Any, Final, NamedTuple

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.text import Annotation

from stickslip_ros.contact.profile import Array
from stickslip_ros.errors import UnknownName
from stickslip_ros.files import replacing
from stickslip_ros.parameters import Spec

DOTS_PER_INCH: Final = 120
UNDATED: Final[Mapping[str, Mapping[str, Any]]] = {
    '.png': {},
    '.svg': {'Date': None},
    '.pdf': {'CreationDate': None},
}
"""Kinds of picture, and the metadata without which a kind has the time in it."""
SAVED: Final = {'svg.hashsalt': 'stickslip', 'pdf.fonttype': 42, 'ps.fonttype': 42}
"""Without the first matplotlib names the parts of an SVG at random; the others make the letters
TrueType, as journals refuse Type 3."""

BLACK, GREY = 'black', '0.4'
BLUE, VERMILION, GREEN, PURPLE = '#0072B2', '#D55E00', '#009E73', '#CC79A7'
ORANGE, SKY_BLUE = '#E69F00', '#56B4E9'
"""Colours that colour-blind people tell apart (Okabe and Ito 2008), without the yellow."""
MM_PER_INCH: Final = 25.4
NARROW_MM: Final = 125.0  # width below which labels have shorter lines and axes fewer of them
MARKER_POINTS: Final = 4.5
LEGEND_EMS: Final = 3.0


class Look(NamedTuple):
    """How wide a figure is, None if as wide as it likes, and the size of its letters."""

    width_mm: float | None
    font_pt: float


WIDTH: Final = Spec(float, 85.0, 'mm', '', 'width of a figure', 40.0, 500.0)
LETTERS: Final = Spec(float, 8.0, 'pt', '', 'size of the letters', 4.0, 24.0)
SCREEN: Final = Look(None, 10.0)
PRINTED_DOTS_PER_INCH: Final = 600
_look: ContextVar[Look] = ContextVar('look', default=SCREEN)


def look_of(width_mm: float | None = None, font_pt: float | None = None) -> Look:
    """Return a look: that of a page if a width is given, else that of a screen."""
    for spec, value in ((WIDTH, width_mm), (LETTERS, font_pt)):
        if value is not None:
            spec.check(spec.text, value)
    usual_pt = SCREEN.font_pt if width_mm is None else float(LETTERS.default)
    return Look(width_mm, font_pt or usual_pt)


@contextmanager
def looking(look: Look) -> Iterator[None]:
    """Let the figures that are begun meanwhile look so."""
    before = _look.set(look)
    try:
        with mpl.rc_context({'font.size': look.font_pt}):
            yield
    finally:
        _look.reset(before)


def is_narrow() -> bool:
    """Return whether the figures that are begun now have little room for words."""
    return (_look.get().width_mm or NARROW_MM) < NARROW_MM


class LookingFigure(Figure):
    """A figure that keeps its look: matplotlib makes some of its letters when it is drawn."""

    def __init__(self, look: Look, **how: Any) -> None:
        self._style = {'font.size': look.font_pt, **SAVED}
        self._dots = DOTS_PER_INCH if look.width_mm is None else PRINTED_DOTS_PER_INCH
        super().__init__(**how)

    def draw(self, renderer: Any) -> None:
        """Draw it in its look."""
        with mpl.rc_context(self._style):
            super().draw(renderer)

    def savefig(self, *where: Any, **how: Any) -> None:
        """Write it in its look, with letters that journals take."""
        with mpl.rc_context(self._style):
            super().savefig(*where, **{'dpi': self._dots, **how})


class CurveStyle(NamedTuple):
    """What tells a curve from its neighbours: colour, and without it dashes and marker."""

    color: str
    linestyle: str | tuple[float, tuple[float, ...]]
    marker: str

    @property
    def line(self) -> dict[str, Any]:
        """As arguments of ``plot``, of a line without points."""
        return {'color': self.color, 'linestyle': self.linestyle}

    @property
    def points(self) -> dict[str, Any]:
        """As arguments of ``plot``, of points without a line."""
        return {**self.line_and_points, 'linestyle': 'none'}

    @property
    def line_and_points(self) -> dict[str, Any]:
        """As arguments of ``plot``, of a line through its points."""
        return {**self._asdict(), 'markersize': MARKER_POINTS}


CURVES: Final = (
    CurveStyle(BLUE, '-', 'o'),
    CurveStyle(VERMILION, '--', 's'),
    CurveStyle(GREEN, '-.', '^'),
    CurveStyle(PURPLE, ':', 'D'),
    CurveStyle(ORANGE, (0.0, (12.0, 3.0)), 'v'),
    CurveStyle(SKY_BLUE, (0.0, (5.0, 1.0, 1.0, 1.0, 1.0, 1.0)), 'P'),
    CurveStyle(BLACK, (0.0, (1.0, 3.0)), 'X'),
)


def curve_style(number: int) -> CurveStyle:
    """Return the style of a curve by its number, from 0; the first 49 differ."""
    round_, place = divmod(number, len(CURVES))
    return CURVES[(place + round_) % len(CURVES)]._replace(color=CURVES[place].color)


def new_figure(width_inches: float, height_inches: float, title: str = '') -> Figure:
    """Return an empty figure whose axes make room for their labels."""
    look = _look.get()
    if look.width_mm is not None:
        ratio = look.width_mm / MM_PER_INCH / width_inches
        # The height goes with the root: letters do not become as small as the figure does.
        width_inches, height_inches = ratio * width_inches, math.sqrt(ratio) * height_inches
    figure = LookingFigure(look, figsize=(width_inches, height_inches), layout='constrained')
    if title:
        figure.suptitle(title)
    return figure


def label_axes(axes: Axes, x_label: str, y_label: str, title: str = '') -> None:
    """Give axes labels, a title and a grid."""
    axes.set_xlabel(x_label)
    axes.set_ylabel(y_label)
    axes.set_title(title, fontsize='medium')
    axes.grid(visible=True, alpha=0.3)


def as_it_is(text: str) -> str:
    """Return a text, such as the name of a file, so that matplotlib sees no formula in it."""
    return text.replace('$', r'\$')


def draw_legend(axes: Axes, place: str = 'best', title: str | None = None) -> None:
    """Give axes a legend whose samples are long enough to show the dashes."""
    axes.legend(loc=place, title=title, fontsize='small', handlelength=LEGEND_EMS)


def label_end(axes: Axes, x: Array, y: Array, text: str, colour: str) -> None:
    """Write a text right of the last point of a curve, in its colour."""
    write_beside(axes, x[-1], y[-1], text, color=colour, annotation_clip=False)


def write_beside(
    axes: Axes, x: float, y: float, text: str, *, left: bool = False, **style: Any
) -> Annotation:
    """Write a text right or left of a place; return it."""
    place = {'xytext': (-4, 0), 'ha': 'right'} if left else {'xytext': (4, 0)}
    return axes.annotate(text, (x, y), textcoords='offset points', va='center', **place, **style)


def check_picture(path: Path) -> None:
    """Refuse, by UnknownName, a picture that is neither PNG nor SVG nor PDF."""
    if path.suffix.lower() not in UNDATED:
        raise UnknownName('kind of picture', path.suffix, f'use {", ".join(UNDATED)}')


def save_figure(figure: Figure, picture: Path) -> None:
    """Write a figure as PNG, SVG or PDF, the same bytes for the same numbers; folders are made."""
    check_picture(picture)
    with replacing(picture) as part:
        _save(figure, part, picture.suffix.lower())


def svg_of(figure: Figure) -> str:
    """Return a figure as SVG, the same text for the same numbers."""
    text = io.StringIO()
    _save(figure, text, '.svg')
    return text.getvalue()


def _save(figure: Figure, file: Path | IO[str], suffix: str) -> None:
    figure.savefig(file, format=suffix[1:], metadata=dict(UNDATED[suffix]))


def decimated(x: Array, y: Array, pixels: int) -> tuple[Array, Array]:
    """Return samples, x rising, that a curve of so many pixels needs: no peak or gap is lost."""
    if len(x) <= 4 * pixels:
        return x, y
    width = (x[-1] - x[0]) / pixels
    edges = np.searchsorted(x, x[0] + width * np.arange(pixels), 'left')
    starts = np.unique(np.append(edges, len(x)))
    kept: list[int] = []
    for first, last in itertools.pairwise(starts.tolist()):
        values = y[first:last]
        is_finite = np.isfinite(values)
        finite, gaps = np.flatnonzero(is_finite), np.flatnonzero(~is_finite)
        chosen = {0, len(values) - 1, *gaps[:1].tolist()}
        if len(finite):
            ends = values[finite].argmin(), values[finite].argmax()
            chosen |= set(finite[list(ends)].tolist())
        kept += sorted(first + index for index in chosen)
    return x[kept], y[kept]
