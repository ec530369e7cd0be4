# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The drawing of the stand as SVG, animated for a film."""

import math
from collections.abc import Iterator

import numpy as np

from stickslip_ros.arrays import Array
from stickslip_ros.drive.layout import contacts_of
from stickslip_ros.errors import OutOfRange, RecordingError
from stickslip_ros.lab.drawing.film import FILM_CYCLES, Film, film_of
from stickslip_ros.lab.drawing.geometry import DIAGONAL, Foot, Geometry, geometry_of
from stickslip_ros.lab.measurements.recorded_run import Run
from stickslip_ros.parameters import Parameters, checked_arguments
from stickslip_ros.units import NM, with_unit

_MOVING = ('voltage_v', 'foot_m', 'position_m')
# Pixels: places from the left and the top, then sizes.
_HEIGHT, _FILM_HEIGHT = 350, 550
_MIDDLE, _AXIS, _SECTION, _CONTACTS = 280.0, 165.0, 635.0, 737.5
_ROWS, _COLUMN, _WIDE_COLUMN, _MARGIN = 3, 75.0, 130.0, 12.5
"""Contacts: rows, width of a column of half a text or of a whole text, margin at the right."""
TABLE, WALL = (20.0, 520.0), 500.0
_CURVES, _LANES = (70.0, 560.0), ((375.0, 445.0), (465.0, 515.0))
_RUNNER, _REACH, _STROKE, _DISC, _SMALL_DISC = 320.0, 84.0, 32.0, 28.0, 20.0
"""Limits: runner length, reach of a foot, stroke, contact radius above two and three lines."""
_LEAST_M, _RUNNER_STROKES = 10e-9, 2.0
"""Least motion that is magnified to a whole stroke, as noise is rest; limit of the runner's."""
SECONDS = 8.0  # length of a film
STYLE = """
svg{--ink:#222;--faint:#667;--paper:#fff;--steel:#a9b4bf;--dark:#8795a3;--frame:#d5dae0;
--runner:#009e73;--foot:#b87800;--slip:#b0568a}
@media(prefers-color-scheme:dark){svg{--ink:#e8eaed;--faint:#a3acb8;--paper:#191d22;
--steel:#76838f;--dark:#5d6975;--frame:#3a414b;
--runner:#2fc49b;--foot:#e69f00;--slip:#e08fbd}}
text{fill:var(--ink);font:13px sans-serif}.faint{fill:var(--faint);font-size:12px}
.end{text-anchor:end}.mid{text-anchor:middle}.line{fill:none;stroke:var(--ink);stroke-width:1.5}
.edge{stroke:var(--ink);stroke-width:.7}.tick{fill:none;stroke:var(--ink);opacity:.5}
.frame{fill:var(--frame)}.steel{fill:var(--steel)}.dark{fill:var(--dark)}
.piezo{fill:#f2c14e}.ruby{fill:#c1272d}.stick{fill:var(--steel)}.slip{fill:var(--slip)}.laser{fill:#6fae8f}
.beam{stroke:#d00;stroke-width:2;stroke-dasharray:7 4}.curve{fill:none;stroke-width:1.6}
.runner{stroke:var(--runner)}.foot{stroke:var(--foot)}.one,.other{stroke:var(--slip)}
.foot,.other{stroke-dasharray:5 3}"""
TIP = """<defs><marker id="tip" viewBox="0 0 10 10" refX="9" refY="5" markerWidth="8"
 markerHeight="8" orient="auto"><path d="M0 0L10 5L0 10z" fill="context-stroke"/></marker>"""


class Drawing(str):
    """An SVG text that a notebook shows."""

    __slots__ = ()

    def _repr_svg_(self) -> str:
        return str(self)


@checked_arguments
def draw_stand(stand: Parameters | Run, end_s: float | None = None) -> Drawing:
    """
    Draw a stand to scale, or the last cycles of a stepping run as a film.

    A film magnifies the motion of feet and runner and slows time; both factors are written below
    it. The slipping share of each contact is computed from the motion.

    Parameters
    ----------
    stand : Parameters or Run
        The stand, or a run of one.
    end_s : float, optional
        End of the cycles of a run, s.

    Returns
    -------
    Drawing
        Text of an SVG, for any browser.

    Raises
    ------
    RecordingError
        If a run has no trace, or no two cycles of a saw-tooth.
    OutOfRange
        If the run ends before ``end_s``.

    Examples
    --------
    >>> picture = draw_stand(Parameters())
    >>> picture[:4], 'F' in picture
    ('<svg', True)

    """
    if isinstance(stand, Parameters):
        return Drawing(stand_svg(stand))
    found = [stand.series[name] for name in _MOVING if name in stand.series]
    if len(found) < len(_MOVING) or len({len(each) for each in found}) > 1:
        raise RecordingError(stand.path, 'has no trace', 'record the topic trace')
    time_s = found[0].time_s
    if end_s is not None and end_s > time_s[-1]:
        limit = f'after the end of the run, {time_s[-1]:g} s'
        raise OutOfRange('end of the cycles', end_s, 's', limit, 'lower it')
    last = len(time_s) if end_s is None else int(np.searchsorted(time_s, end_s, 'right'))
    values = (each.value[:last] for each in found)
    film = film_of(stand.parameters, time_s[:last], *values)
    if film is None:
        problem = f'has no {FILM_CYCLES} cycles of a saw-tooth{"" if end_s is None else " so far"}'
        raise RecordingError(stand.path, problem, 'draw its parameters')
    return Drawing(stand_svg(stand.parameters, film))


def stand_svg(parameters: Parameters, film: Film | None = None) -> str:
    """Return the drawing of a stand as SVG; a film moves it."""
    geometry = geometry_of(parameters)
    scale = min(_RUNNER / geometry.length_m, _REACH / (DIAGONAL * geometry.reach_m))
    feet, times, runner = len(geometry.feet), 1.0, None
    height = _HEIGHT if film is None else _FILM_HEIGHT
    grid = max(2, math.ceil(feet / _ROWS)), _COLUMN if geometry.is_of_paper else _WIDE_COLUMN
    width = round(_CONTACTS + grid[0] * grid[1] + _MARGIN)
    if film is not None:
        way_m = float(np.ptp(film.runner_m)) / _RUNNER_STROKES
        stroke = scale * max(float(np.ptp(film.feet_m, axis=1).max()), way_m, _LEAST_M)
        times = 10.0 ** math.floor(math.log10(_STROKE / stroke))
        times *= max(each for each in (1.0, 2.0, 5.0) if each * times * stroke <= _STROKE)
        runner = times * scale * film.runner_m
    title = f'The stand: ruby feet ({feet}), runner, preload, load cell, interferometer'
    size = f'width="{width}" height="{height}"'
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" {size} viewBox="0 0 {width} {height}">',
        f'<title>{title}</title><style>{STYLE}</style>',
        f'{TIP}{"".join(_feet(geometry, scale, film, times))}</defs>',
        f'<rect {size} fill="var(--paper)"/>',
        *_side(parameters, geometry, scale, runner),
        *_section(geometry, scale),
        *_contacts(parameters, geometry, film, grid),
    ]
    if film is not None:
        parts += _curves(film, geometry.feet, is_shared=parameters.contact.law == 'mdr')
        words = f'{1e3 * film.length_s:.4g} ms are shown in {SECONDS:g} s; motion of feet and '
        words += f'runner magnified {times:,.0f} times'.replace(',', ' ')
        parts.append(_text(_CURVES[0], _LANES[-1][1] + 20, words, 'faint'))
    return '\n'.join([*parts, '</svg>\n'])


def _feet(geometry: Geometry, scale: float, film: Film | None, times: float) -> Iterator[str]:
    """Yield an upright foot of each kind: its piezo is fixed below, and shears."""
    width = scale * geometry.piezo_m[0]
    for name, foot in {each.alike: each for each in geometry.feet[::-1]}.items():
        length = scale * DIAGONAL * foot.base_m
        way = None if film is None else times * scale * film.feet_m[foot.number - 1]
        angles = None if way is None else -np.degrees(np.arctan(way / length))
        yield (
            f'<g id="{name}"><g>{_box(-0.5 * width, -length, width, length, f"{foot.base} edge")}'
            f'{_animation("skewX", angles)}</g><g><circle class="ruby edge" cy="{_px(-length)}" '
            f'r="{_px(scale * foot.radius_m)}"/>{_animation("translate", way)}</g></g>'
        )


def _side(
    parameters: Parameters, geometry: Geometry, scale: float, runner: Array | None
) -> Iterator[str]:
    """Yield the side view, with the feet in front."""
    half, edge = 0.5 * scale * geometry.length_m, scale * DIAGONAL * geometry.width_m
    left, right, reach = _MIDDLE - half, _MIDDLE + half, scale * DIAGONAL * geometry.reach_m
    above, below, ground = _AXIS - reach, _AXIS + reach, _AXIS + reach + 22
    span = scale * (max(abs(each.x_m) for each in geometry.feet) + 4.0 * geometry.radius_m)
    top = span * (0.6 if geometry.is_of_paper else 1.0)
    yield _box(_MIDDLE - top, above - 14, 2 * top, 14, 'frame edge')
    yield _box(_MIDDLE - span, below, 2 * span, 22, 'frame edge')
    yield _box(TABLE[0], ground, TABLE[1] - TABLE[0], 10, 'frame edge')
    if not geometry.is_of_paper:  # its feet hide each other
        yield from _in_place(geometry, scale, side=1)
    # The runner stands on its edge: its lower faces are in shade.
    ticks = ''.join(f'M{_px(_MIDDLE + at * half / 12)} {_AXIS - 5}v10' for at in range(-11, 12))
    yield (
        f'<g>{_box(left, _AXIS - edge, 2 * half, edge, "steel edge")}'
        f'{_box(left, _AXIS, 2 * half, edge, "dark edge")}<path class="tick" d="{ticks}"/>'
        f'{_animation("translate", runner)}</g>'
    )
    front = _in_place(geometry, scale, side=-1)
    yield from front if geometry.is_of_paper else ('<g opacity="0.5">', *front, '</g>')
    spring = ''.join(f'l{12 * (-1) ** at} 4' for at in range(8))
    spring = f'M{_MIDDLE} {_px(above - 54)}v4{spring}v4'
    yield f'<path class="line" d="{spring}" marker-end="url(#tip)"/>'
    preload = with_unit(parameters.stand.preload, 'N')
    yield _text(_MIDDLE + 22, above - 32, f'preload F_p = {preload}')
    yield _box(30, _AXIS - 20, 50, 40, 'laser edge')
    yield _box(45, _AXIS + 20, 20, ground - _AXIS - 20, 'frame edge')
    beam = None if runner is None else left + runner
    yield (
        f'<line class="beam" x1="80" y1="{_AXIS}" x2="{_px(left)}" y2="{_AXIS}">'
        f'{_animation("x2", beam)}</line>{_text(20, _AXIS - 28, "interferometer")}'
    )
    yield from _load_cell(parameters, geometry, scale, runner)
    yield _box(WALL, _AXIS - 30, 20, ground - _AXIS + 30, 'frame edge')
    runner_y = _AXIS - edge - 8 if geometry.is_of_paper else above - 24  # clear of many feet
    yield _text(left, runner_y, f'runner, steel, {1e3 * parameters.runner.mass:.5g} g')
    if geometry.is_of_paper:
        yield _text(_MIDDLE - span - 8, below + 14, 'foot on its piezo', 'end')
    else:
        yield _text(_MIDDLE, ground + 30, 'feet on their piezos', 'mid')
    yield f'<path class="line" d="M{_px(right - 50)} {_px(below)}h44" marker-end="url(#tip)"/>'
    yield _text(right, below + 4, 'x')
    bar_m = 10.0 ** math.floor(math.log10(0.5 * geometry.length_m))
    yield f'<path class="line" d="M20 {_px(ground + 22)}v6h{_px(scale * bar_m)}v-6"/>'
    yield _text(28 + scale * bar_m, ground + 30, f'{1e3 * bar_m:g} mm', 'faint')


def _in_place(geometry: Geometry, scale: float, *, side: int) -> Iterator[str]:
    """Yield the feet of a side, with their numbers unless the stand is that of the paper."""
    for each in geometry.feet:
        if each.side == side:
            x, y = _MIDDLE + scale * each.x_m, scale * DIAGONAL * each.up * geometry.reach_m
            turn = ' scale(1 -1)' if each.up > 0 else ''
            place = f'translate({_px(x)} {_px(_AXIS - y)}){turn}'
            yield f'<use href="#{each.alike}" transform="{place}"/>'
            if not geometry.is_of_paper:
                yield _text(x, _AXIS - y + (6 - 9 * each.up), f'{each.number}', 'mid faint')


def _load_cell(
    parameters: Parameters, geometry: Geometry, scale: float, runner: Array | None
) -> Iterator[str]:
    """Yield the spring between runner (or gap) and wall."""
    if parameters.load_cell.contact == 'absent':
        yield _text(WALL + 20, _AXIS - 37, 'no load cell', 'faint end')
        return
    length = max(WALL - _MIDDLE - scale * geometry.cell_m, 20.0)
    zigzag = ''.join(f'l{_px(-length / 8)} {12 * (-1) ** at}' for at in range(6))
    is_fixed = parameters.load_cell.contact == 'attached'
    scales = None if runner is None or not is_fixed else 1.0 - runner / length
    button = '' if is_fixed else f'M{_px(-length)} -9v18'
    yield (
        f'<g transform="translate({WALL} {_AXIS})"><g><path class="line" '
        f'd="M0 0l{_px(-length / 8)} -6{zigzag}L{_px(-length)} 0{button}"/>'
        f'{_animation("scale", scales, 4)}</g></g>'
    )
    yield _text(WALL + 20, _AXIS - 52, 'load cell', 'end')
    stiffness = f'{1e-3 * parameters.load_cell.stiffness:.4g} kN/m'
    yield _text(WALL + 20, _AXIS - 37, stiffness, 'faint end')


def _section(geometry: Geometry, scale: float) -> Iterator[str]:
    half, feet = 0.5 * scale * geometry.width_m, geometry.feet
    turned = {180 - each.side * (90 + 45 * each.up): each for each in reversed(feet)}
    width, reach = scale * geometry.piezo_m[0], scale * geometry.reach_m
    yield _text(_SECTION, 28, 'across the motion', 'mid')
    for angle, foot in sorted(turned.items()):
        radius = scale * foot.radius_m
        yield f'<g transform="translate({_SECTION} {_AXIS}) rotate({angle})">'
        ball = f'a{_px(radius)} {_px(radius)} 0 0 0 {_px(2 * radius)} 0z'
        yield f'<path class="ruby edge" d="M{_px(-radius)} {_px(-half - radius)}{ball}"/>'
        yield _box(-0.5 * width, -reach, width, reach - half - radius, f'{foot.base} edge')
        yield _box(-0.5 * width - 6, -reach - 9, width + 12, 9, 'frame edge') + '</g>'
    yield f'<g transform="translate({_SECTION} {_AXIS}) rotate(45)">'
    yield _box(-half, -half, 2 * half, 2 * half, 'steel edge') + '</g>'
    above = sum(each.up > 0 for each in feet)
    words = f'feet: {above} above, {len(feet) - above} below'
    yield _text(_SECTION, _AXIS + DIAGONAL * reach + 32, words, 'mid faint')


def _contacts(
    parameters: Parameters, geometry: Geometry, film: Film | None, grid: tuple[int, float]
) -> Iterator[str]:
    """Yield the contact areas, and the slipping share of each."""
    contacts, law = contacts_of(parameters), parameters.contact.law
    largest_m = max(each.indentation.radius_m for each in contacts)
    feet, (columns, column) = geometry.feet, grid
    disc = _SMALL_DISC if any(map(_mark, feet)) else _DISC
    title = 'contacts' if law == 'mdr' else f'contacts, not of {law}'
    yield _text(_CONTACTS + 0.5 * columns * column, 28, title, 'mid')
    for at, (foot, each) in enumerate(zip(feet, contacts, strict=True)):
        x, y = _CONTACTS + (at % columns + 0.5) * column, 70.0 + 95.0 * (at // columns)
        radius = disc * each.indentation.radius_m / largest_m
        core = None if film is None or law != 'mdr' else radius * np.sqrt(1.0 - film.slipping[at])
        circle = f'cx="{x}" cy="{y}" r="{_px(radius)}"'
        yield f'<circle class="slip edge" {circle}/>'
        yield f'<circle class="stick" {circle}>{_animation("r", core)}</circle>'
        row = feet[at - at % columns :][:columns]
        own = [beside for beside in row if beside.place == foot.place]
        if foot == own[-1]:  # a text for neighbours of one group
            normal = f'{foot.place}: {with_unit(each.indentation.normal_force_n, "N")}'
            radius_um = f'radius {1e6 * each.indentation.radius_m:.3g} um'
            x -= 0.5 * (len(own) - 1) * column
            for line, words in enumerate(filter(None, (normal, radius_um, _mark(foot))), 1):
                yield _text(x, y + disc + 14 * line, words, 'mid faint')
    for x, kind in ((768, 'stick'), (838, 'slip')):
        yield _box(x, 335, 11, 11, kind) + _text(x + 15, 345, f'{kind}s')


def _mark(foot: Foot) -> str:
    """Return what sets the motion of a foot apart from that of the nominal foot."""
    gain, delay_s = foot.group.gain, foot.group.delay_s
    words = f'gain {gain:g}' * (gain != 1.0), f'delay {1e3 * delay_s:.3g} ms' * (delay_s > 0.0)
    return ', '.join(filter(None, words)) if gain else 'guide'


def _curves(film: Film, feet: tuple[Foot, ...], *, is_shared: bool) -> Iterator[str]:
    """Yield motion and slipping shares over time, with a moving time line."""
    left, right = _CURVES
    x = np.linspace(left, right, len(film.foot_m))
    ways = NM * np.stack((film.foot_m, film.runner_m))
    shares = 100.0 * film.slipping[[0, -1]]
    named = {f'contact {feet[0].place}': 'one', f'contact {feet[-1].place}': 'other'}
    high = max(ways.max(), ways.min() + NM * _LEAST_M)
    lanes = (
        (ways, {'foot': 'foot', 'runner': 'runner'}, 'nm', ways.min(), high),
        (shares, named, '% slips', 0.0, 100.0),
    )
    shown = zip(_LANES, lanes[: 1 + is_shared], strict=False)
    for (top, bottom), (rows, names, unit, low, high) in shown:
        places = bottom - (rows - low) / (high - low) * (bottom - top)
        for at, (name, kind) in enumerate(names.items()):
            points = ' '.join(f'{_px(a)},{_px(b)}' for a, b in zip(x, places[at], strict=True))
            yield f'<polyline class="curve {kind}" points="{points}"/>'
            y = _px(top + 10 + 20 * at)
            yield f'<path class="curve {kind}" d="M{right + 16} {y}h18"/>'
            yield _text(right + 40, top + 14 + 20 * at, name)
        yield _text(left - 6, top + 5, f'{round(high)}', 'faint end')
        yield _text(left - 6, bottom + 4, f'{round(low)}', 'faint end')
        yield _text(right + 40, top + 54, unit, 'faint')
        yield f'<path class="tick" d="M{left} {top}V{bottom}H{right}"/>'
    along = _animation('translate', np.array([0.0, right - left]))
    yield f'<path class="line" d="M{left} {_LANES[0][0]}V{_LANES[-1][1]}">{along}</path>'


def _box(x: float, y: float, width: float, height: float, kind: str) -> str:
    size = f'width="{_px(width)}" height="{_px(height)}"'
    return f'<rect x="{_px(x)}" y="{_px(y)}" {size} class="{kind}"/>'


def _text(x: float, y: float, words: str, kind: str = '') -> str:
    words = words.replace('F_p', 'F<tspan font-size="10" dy="3">p</tspan><tspan dy="-3"> </tspan>')
    return f'<text x="{_px(x)}" y="{_px(y)}" class="{kind}">{words}</text>'


def _animation(what: str, values: Array | None, digits: int = 1) -> str:
    """Return the animation of the enclosing element; a scale acts along x only."""
    if values is None:
        return ''
    tag = f'<animate attributeName="{what}"'
    if what in {'translate', 'skewX', 'scale'}:
        tag = f'<animateTransform attributeName="transform" type="{what}"'
    end = ' 1' if what == 'scale' else ''
    places = ';'.join(_px(each, digits) + end for each in values.tolist())
    return f'{tag} dur="{SECONDS:g}s" repeatCount="indefinite" values="{places}"/>'


def _px(value: float, digits: int = 1) -> str:
    return f'{round(value, digits) + 0.0:g}'
