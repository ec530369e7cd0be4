# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The stand as URDF: frames and bodies for RViz, tf2 and other readers of robots."""

import math
from collections.abc import Mapping
from xml.sax.saxutils import quoteattr

from stickslip_ros.drive.build import friction_limit_n
from stickslip_ros.errors import OutOfRange, WrongKind
from stickslip_ros.lab.drawing.geometry import DIAGONAL, geometry_of
from stickslip_ros.parameters import Parameters, checked_arguments

_COLOURS = {
    'steel': '0.6 0.65 0.7 1',
    'piezo': '0.95 0.76 0.3 1',
    'ruby': '0.76 0.15 0.18 1',
    'frame': '0.82 0.85 0.88 1',
}
Place = tuple[float, float, float]
ORIGIN: Place = (0.0, 0.0, 0.0)
_AXES_RPY_RAD = ORIGIN, (0.0, 0.0, 0.5 * math.pi), (0.0, -0.5 * math.pi, 0.0)
"""Turn of the stand along x, y, z relative to its carrier."""


@checked_arguments
def robot_description(parameters: Parameters, *carried: Parameters) -> str:
    """
    Return stands as URDF, each mounted on the runner of the one before.

    Frames come from ``frame_id.*``, the moving joint is ``sim.joint_name`` (of ``joint_states``),
    its speed limit that of stepping. Sizes are those of the drawing. The stands move along x, y
    and z; the mounting is assumed.

    Parameters
    ----------
    parameters : Parameters
        The stand.
    *carried : Parameters
        One or two more stands, with their own frame and joint names.

    Raises
    ------
    OutOfRange
        Above three stands.
    WrongKind
        If a frame or joint name is repeated.

    """
    stands = (parameters, *carried)
    if len(stands) > len(_AXES_RPY_RAD):
        limit = f'above the {len(_AXES_RPY_RAD)} axes'
        raise OutOfRange('stands', len(stands), '', limit, 'draw fewer')
    owned = ((*vars(each.frame_id).values(), each.sim.joint_name) for each in stands)
    names = [name for each in owned for name in each]
    for name in names:
        if names.count(name) > 1:
            hint = 'set frame_id.* and sim.joint_name'
            raise WrongKind('frame or joint', name, 'the name of one alone', hint)
    colours = _COLOURS.items()
    parts = [f'<material name="{name}"><color rgba="{c}"/></material>' for name, c in colours]
    before: Parameters | None = None
    for stand, rpy_rad in zip(stands, _AXES_RPY_RAD, strict=False):
        parts += _stand(stand)
        if before is not None:
            base, half_m = stand.frame_id.stage, 1.5 * geometry_of(stand).length_m
            at = _at((0.0, 0.0, half_m), *rpy_rad)
            parts.append(_joint(f'{base}_mount', 'fixed', before.frame_id.runner, base, at))
        before = stand
    inside = '\n'.join(f'  {each}' for each in parts)
    return f'<?xml version="1.0"?>\n<robot name="stickslip_stand">\n{inside}\n</robot>\n'


def _stand(parameters: Parameters) -> list[str]:
    geometry, frames, stand = geometry_of(parameters), parameters.frame_id, parameters.stand
    length_m, width_m, piezo_m = geometry.length_m, geometry.width_m, geometry.piezo_m[0]
    amplifier, mass_kg = parameters.amplifier, parameters.runner.mass
    along, across = mass_kg * width_m**2 / 6.0, mass_kg * (length_m**2 + width_m**2) / 12.0
    moments = {'ixx': along, 'iyy': across, 'izz': across, 'ixy': 0.0, 'ixz': 0.0, 'iyz': 0.0}
    inertia = f'<mass value="{mass_kg:.9g}"/><inertia {_attributes(moments)}/>'
    stroke_m = parameters.actuator.gain * amplifier.range_v
    stroke_m *= max(map(abs, parameters.feet.gain))
    limits = {
        'lower': stand.travel_min,
        'upper': stand.travel_max,
        'effort': friction_limit_n(parameters),
        'velocity': stroke_m * amplifier.frequency_max,
    }
    slide = f'<axis xyz="1 0 0"/><limit {_attributes(limits)}/>'
    table = _box((3.0 * length_m, 0.5 * length_m, 2.0 * geometry.radius_m))
    below_m = -DIAGONAL * geometry.reach_m - 2.0 * geometry.radius_m
    bar = _body(_box((length_m, width_m, width_m)), 'steel', ORIGIN, 0.25 * math.pi)
    parts = [
        _link(frames.stage, _body(table, 'frame', (0.0, 0.0, below_m))),
        _link(frames.runner, f'{bar}<inertial>{inertia}</inertial>'),
        _joint(parameters.sim.joint_name, 'prismatic', frames.stage, frames.runner, slide),
    ]
    prefix, slash, _ = frames.stage.rpartition('/')
    for foot in geometry.feet:
        piezo_long_m, radius_m = foot.base_m, foot.radius_m
        away_m = 0.5 * DIAGONAL * piezo_long_m
        place, turn = (0.0, foot.side * away_m, foot.up * away_m), -0.25 * foot.side * foot.up
        piezo = _body(_box((piezo_m, piezo_m, piezo_long_m)), foot.base, place, math.pi * turn)
        ball = _body(f'<sphere radius="{radius_m:.9g}"/>', 'ruby')
        name = f'{prefix}{slash}foot_{foot.number}'
        at = _at(foot.at(0.5 * width_m + radius_m))
        parts += [
            _link(name, ball + piezo),
            _joint(f'{name}_joint', 'fixed', frames.stage, name, at),
        ]
    is_there = parameters.load_cell.contact != 'absent'
    cell = _body(_box((width_m,) * 3), 'frame', (0.5 * width_m, 0.0, 0.0)) if is_there else ''
    at = _at((geometry.cell_m, 0.0, 0.0))
    parts += [
        _link(frames.load_cell, cell),
        _joint(f'{frames.load_cell}_joint', 'fixed', frames.stage, frames.load_cell, at),
    ]
    return parts


def _link(name: str, inside: str) -> str:
    return f'<link name={quoteattr(name)}>{inside}</link>'


def _joint(name: str, kind: str, parent: str, child: str, inside: str) -> str:
    ends = f'<parent link={quoteattr(parent)}/><child link={quoteattr(child)}/>'
    return f'<joint name={quoteattr(name)} type="{kind}">{ends}{inside}</joint>'


def _body(shape: str, colour: str, place_m: Place = ORIGIN, roll_rad: float = 0.0) -> str:
    shape = f'{_at(place_m, roll_rad)}<geometry>{shape}</geometry>'
    return f'<visual>{shape}<material name="{colour}"/></visual>'


def _box(size_m: Place) -> str:
    return f'<box size="{_row(size_m)}"/>'


def _at(place_m: Place, *rpy_rad: float) -> str:
    turn = _row((*rpy_rad, 0.0, 0.0, 0.0)[:3])
    return f'<origin xyz="{_row(place_m)}" rpy="{turn}"/>'


def _row(values: tuple[float, ...]) -> str:
    return ' '.join(f'{each:.9g}' for each in values)


def _attributes(values: Mapping[str, float]) -> str:
    return ' '.join(f'{name}="{value:.9g}"' for name, value in values.items())
