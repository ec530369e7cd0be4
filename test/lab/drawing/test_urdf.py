# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The URDF, read by a parser of ROS: frames, joint and bodies are those of the parameters."""

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from stickslip_ros import Parameters, robot_description
from stickslip_ros.drive.layout import contacts_of
from stickslip_ros.errors import OutOfRange, WrongKind

parser = pytest.importorskip('urdf_parser_py.urdf', reason='pip install urdf-parser-py')

LEFT = {
    'frame_id.stage': 'left/stage_base',
    'frame_id.runner': 'left/runner',
    'frame_id.load_cell': 'left/<cell>',
    'sim.joint_name': 'left_joint',
}


@pytest.mark.parametrize('values', [{}, LEFT, {'load_cell.contact': 'absent'}])
def test_every_frame_hangs_on_that_of_the_stage(values: dict[str, object]):
    parameters = Parameters().updated(values)
    robot = parser.URDF.from_xml_string(robot_description(parameters).encode())
    frames = parameters.frame_id
    assert robot.get_root() == frames.stage
    assert {frames.stage, frames.runner, frames.load_cell} < {each.name for each in robot.links}
    assert len(robot.joints) == len(robot.links) - 1
    for link in robot.links:
        if link.name not in {frames.stage, frames.load_cell}:
            assert robot.get_chain(frames.stage, link.name)[0] == frames.stage
            assert link.visuals


def test_the_one_joint_that_moves_is_that_of_joint_states_within_its_travel_and_speed():
    parameters = Parameters().updated({**LEFT, 'stand.travel_max': 2e-3})
    robot = parser.URDF.from_xml_string(robot_description(parameters).encode())
    [joint] = [each for each in robot.joints if each.type != 'fixed']
    assert (joint.name, joint.type, joint.axis) == ('left_joint', 'prismatic', [1, 0, 0])
    assert (joint.parent, joint.child) == ('left/stage_base', 'left/runner')
    assert (joint.limit.lower, joint.limit.upper) == (-5e-3, 2e-3)
    assert joint.limit.effort == pytest.approx(0.3 * 2.0 * math.sqrt(2.0) * 0.5)
    assert joint.limit.velocity == pytest.approx(160e-9 * 20e3)


def test_the_runner_has_its_mass_and_the_moments_of_a_bar_of_this_size_and_density():
    robot = parser.URDF.from_xml_string(robot_description(Parameters()).encode())
    runner = next(each for each in robot.links if each.name == 'runner')
    length_m, width_m, height_m = runner.visual.geometry.size
    assert runner.inertial.mass == 3e-3
    assert length_m * width_m * height_m * 7700.0 == pytest.approx(3e-3)
    inertia = runner.inertial.inertia
    assert inertia.ixx == pytest.approx(3e-3 * (width_m**2 + height_m**2) / 12.0)
    assert inertia.iyy == inertia.izz == pytest.approx(3e-3 * (length_m**2 + width_m**2) / 12.0)


def test_the_hemispheres_touch_the_faces_of_the_bar_and_their_forces_balance_the_preload():
    parameters = Parameters()
    robot = parser.URDF.from_xml_string(robot_description(parameters).encode())
    runner = next(each for each in robot.links if each.name == 'runner')
    length_m, width_m, _ = runner.visual.geometry.size
    along_n = across_n = 0.0
    for number, contact in enumerate(contacts_of(parameters), 1):
        joint = next(each for each in robot.joints if each.child == f'foot_{number}')
        x, y, z = joint.origin.xyz
        distance_m = math.hypot(y, z)
        assert distance_m == pytest.approx(0.5 * width_m + parameters.contact.radius)
        assert abs(x) + parameters.stand.travel_max < 0.5 * length_m
        normal_n = contact.indentation.normal_force_n
        along_n -= normal_n * z / distance_m * (z > 0.0)
        across_n -= normal_n * y / distance_m
        # From the sphere on the piezo leads straight away from the runner.
        piezo = robot.link_map[f'foot_{number}'].visuals[1]
        roll = piezo.origin.rpy[0]
        axis = -math.sin(roll), math.cos(roll)
        middle = piezo.origin.xyz[1:]
        assert axis[0] * middle[1] == pytest.approx(axis[1] * middle[0])
        assert (middle[0] * y, middle[1] * z) > (0.0, 0.0)
    assert along_n == pytest.approx(-parameters.stand.preload)
    assert across_n == pytest.approx(0.0, abs=1e-12)


def test_other_feet_stand_in_opposite_pairs_and_a_guide_is_no_piezo():
    values = {
        'feet.count': [3, 2],
        'feet.share': [0.4, 0.2],
        'feet.gain': [1.0, 0.0],
        'feet.radius': [0.0, 1e-4],
    }
    robot = parser.URDF.from_xml_string(robot_description(Parameters().updated(values)).encode())
    places = [robot.joint_map[f'foot_{k}_joint'].origin.xyz for k in range(1, 6)]
    assert [np.sign(z) for _, _, z in places] == [-1, 1, -1, 1, -1]
    assert [np.sign(y) for _, y, _ in places] == [-1, 1, 1, -1, -1]
    assert [x for x, _, _ in places] == pytest.approx([-8e-3 / 2, -8e-3 / 2, 0.0, 0.0, 8e-3 / 2])
    shapes = [robot.link_map[f'foot_{k}'].visuals for k in range(1, 6)]
    assert [ball.geometry.radius for ball, _ in shapes] == [5e-4] * 3 + [1e-4] * 2
    assert [base.material.name for _, base in shapes] == ['piezo'] * 3 + ['frame'] * 2


def test_the_speed_limit_is_that_of_the_feet_with_the_largest_gain():
    robot = parser.URDF.from_xml_string(
        robot_description(Parameters().updated({'feet.gain': [1.0, -2.0]})).encode()
    )
    assert robot.joint_map['runner_joint'].limit.velocity == pytest.approx(2 * 160e-9 * 20e3)


def axis(name: str) -> Parameters:
    frames = {f'frame_id.{each}': f'{name}/{each}' for each in ('stage', 'runner', 'load_cell')}
    return Parameters().updated({**frames, 'sim.joint_name': f'{name}_joint'})


def test_three_stands_on_each_other_move_along_x_y_and_z():
    text = robot_description(*map(axis, 'xyz'))
    robot = parser.URDF.from_xml_string(text.encode())
    assert robot.get_root() == 'x/stage'
    assert len(robot.joints) == len(robot.links) - 1
    chain = [robot.joint_map[each] for each in robot.get_chain('x/stage', 'z/runner', links=False)]
    turned, directions = Rotation.identity(), []
    for joint in chain:
        turned *= Rotation.from_euler('xyz', joint.origin.rpy if joint.origin else [0, 0, 0])
        if joint.type == 'prismatic':
            directions.append(turned.apply(joint.axis))
    assert np.array(directions) == pytest.approx(np.eye(3), abs=1e-8)


def test_stands_that_share_a_name_or_are_more_than_axes_are_refused():
    with pytest.raises(WrongKind, match="'stage_base' is not the name of one alone"):
        robot_description(Parameters(), Parameters())
    with pytest.raises(OutOfRange, match='stands 4 is above the 3 axes'):
        robot_description(*map(axis, 'uxyz'))
