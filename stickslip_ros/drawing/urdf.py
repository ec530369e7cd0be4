"""The stand as a URDF: frames and bodies for RViz, tf2 and what else reads robots."""

import math
import xml.etree.ElementTree as ET

from stickslip_ros.drawing.geometry import DIAGONAL, Geometry, geometry_of
from stickslip_ros.drive.build import friction_limit_n
from stickslip_ros.parameters import Parameters

COLOURS = {
    'steel': '0.6 0.65 0.7 1',
    'piezo': '0.95 0.76 0.3 1',
    'ruby': '0.76 0.15 0.18 1',
    'frame': '0.82 0.85 0.88 1',
}


def robot_description(parameters: Parameters) -> str:
    """
    Return the stand as URDF.

    Its frames are those of ``frame_id.*``; its one joint that moves is ``sim.joint_name``, which
    ``joint_states`` moves. Sizes are those of the drawing: the physics has none.

    Parameters
    ----------
    parameters : Parameters
        The stand.

    """
    geometry, frames = geometry_of(parameters), parameters.frame_id
    prefix = frames.stage.rpartition('/')[0]
    name_of = f'{prefix}/{{}}'.format if prefix else str
    robot = ET.Element('robot', name='stickslip_stand')
    for name, colour in COLOURS.items():
        ET.SubElement(ET.SubElement(robot, 'material', name=name), 'color', rgba=colour)
    stage, length_m = ET.SubElement(robot, 'link', name=frames.stage), geometry.length_m
    drop_m = -DIAGONAL * geometry.reach_m - 2.0 * geometry.radius_m
    table_m = (3.0 * length_m, 0.5 * length_m, 2.0 * geometry.radius_m)
    _add_box(stage, table_m, 'frame', (0.0, 0.0, drop_m))
    _add_runner(robot, parameters, geometry)
    for foot in geometry.feet:
        body = _add_fixed(
            robot,
            frames.stage,
            name_of(f'foot_{foot.number}'),
            foot.at(0.5 * geometry.width_m + geometry.radius_m),
        )
        _add_shape(body, 'ruby', 'sphere', radius=_text(geometry.radius_m))
        width_m, long_m = geometry.piezo_m
        angle = -foot.side * foot.up * 0.25 * math.pi
        shift_m = 0.5 * DIAGONAL * long_m
        place = (0.0, foot.side * shift_m, foot.up * shift_m)
        _add_box(body, (width_m, width_m, long_m), 'piezo', place, angle)
    cell = _add_fixed(robot, frames.stage, frames.load_cell, (geometry.cell_m, 0.0, 0.0))
    if parameters.load_cell.contact != 'absent':
        size_m = geometry.width_m
        _add_box(cell, (size_m, size_m, size_m), 'frame', (0.5 * size_m, 0.0, 0.0))
    ET.indent(robot)
    return ET.tostring(robot, encoding='unicode', xml_declaration=True) + '\n'


def _add_runner(robot: ET.Element, parameters: Parameters, geometry: Geometry) -> None:
    """Add the runner, and the joint along which it goes at most as fast as it can step."""
    mass_kg, stand, amplifier = parameters.runner.mass, parameters.stand, parameters.amplifier
    width_m, length_m = geometry.width_m, geometry.length_m
    link = ET.SubElement(robot, 'link', name=parameters.frame_id.runner)
    _add_box(link, (length_m, width_m, width_m), 'steel', (0.0, 0.0, 0.0), 0.25 * math.pi)
    inertial = ET.SubElement(link, 'inertial')
    ET.SubElement(inertial, 'mass', value=_text(mass_kg))
    along, across = width_m**2 / 6.0, (length_m**2 + width_m**2) / 12.0
    moments = {'ixx': along, 'iyy': across, 'izz': across, 'ixy': 0.0, 'ixz': 0.0, 'iyz': 0.0}
    ET.SubElement(inertial, 'inertia', {key: _text(mass_kg * m2) for key, m2 in moments.items()})
    joint = _add_joint(
        robot, parameters.sim.joint_name, 'prismatic', parameters.frame_id.stage, link
    )
    ET.SubElement(joint, 'axis', xyz='1 0 0')
    stroke_m = parameters.actuator.gain * (amplifier.voltage_max - amplifier.voltage_min)
    limits = {
        'lower': stand.travel_min,
        'upper': stand.travel_max,
        'effort': friction_limit_n(parameters),
        'velocity': stroke_m * amplifier.frequency_max,
    }
    ET.SubElement(joint, 'limit', {name: _text(value) for name, value in limits.items()})


def _add_fixed(
    robot: ET.Element, parent: str, name: str, place_m: tuple[float, float, float]
) -> ET.Element:
    link = ET.SubElement(robot, 'link', name=name)
    joint = _add_joint(robot, f'{name}_joint', 'fixed', parent, link)
    ET.SubElement(joint, 'origin', xyz=' '.join(map(_text, place_m)))
    return link


def _add_joint(
    robot: ET.Element, name: str, kind: str, parent: str, child: ET.Element
) -> ET.Element:
    joint = ET.SubElement(robot, 'joint', name=name, type=kind)
    ET.SubElement(joint, 'parent', link=parent)
    ET.SubElement(joint, 'child', link=child.attrib['name'])
    return joint


def _add_box(
    link: ET.Element,
    size_m: tuple[float, float, float],
    colour: str,
    place_m: tuple[float, float, float],
    roll_rad: float = 0.0,
) -> None:
    visual = _add_shape(link, colour, 'box', size=' '.join(map(_text, size_m)))
    rotation = f'{_text(roll_rad)} 0 0'
    ET.SubElement(visual, 'origin', xyz=' '.join(map(_text, place_m)), rpy=rotation)


def _add_shape(link: ET.Element, colour: str, kind: str, **size: str) -> ET.Element:
    visual = ET.SubElement(link, 'visual')
    ET.SubElement(ET.SubElement(visual, 'geometry'), kind, size)
    ET.SubElement(visual, 'material', name=colour)
    return visual


def _text(value: float) -> str:
    return f'{value:.9g}'
