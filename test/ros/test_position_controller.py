"""The position controller: over topics only, on a stand with the faults of real hardware."""

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from geometry_msgs.msg import PointStamped
from rclpy.parameter import Parameter

from stickslip_ros.parameters import load_yaml, specs
from stickslip_ros.ros.position_controller import PositionController
from stickslip_ros.testing import Operator, open_context

REALISTIC = load_yaml(Path(__file__).parents[2] / 'config' / 'realistic.yaml').changed()
TOLERANCE_M = 5e-9
"""What the controller promises, of the true position."""
TARGETS_M = (100e-9, -1e-6, 10e-6, 100e-6)
HOLD_S = 0.2
LOAD_N = 0.05


@pytest.fixture
def settings(tmp_path: Path) -> Path:
    """Give a parameter file with a value of the drive and one of the controller."""
    path = tmp_path / 'settings.yaml'
    text = '/**:\n  ros__parameters:\n    actuator: {gain: 1.0e-9}\n    tolerance: 3.0e-9\n'
    path.write_text(text, encoding='utf-8')
    return path


def test_the_controller_passes_over_what_a_file_says_to_the_drive(ros_domain: int, settings: Path):
    context = open_context(ros_domain)
    words = ['--ros-args', '--params-file', str(settings)]
    controller = PositionController(context=context, cli_args=words)
    assert controller.get_parameter('tolerance').value == 3e-9
    assert controller.get_parameter('gain').value == specs()['actuator.gain'].default
    assert not controller.has_parameter('actuator.gain')
    assert controller.describe_parameter('gain').read_only
    present = [controller.get_parameter(name) for name in controller.get_parameters_by_prefix('')]
    assert controller.set_parameters_atomically(present).successful
    assert not controller.set_parameters_atomically([Parameter('gain', value=2e-9)]).successful
    controller.destroy_node()
    context.try_shutdown()


def test_a_target_in_another_frame_is_refused_and_the_last_one_kept(ros_domain: int):
    context = open_context(ros_domain)
    operator, controller = Operator(context), PositionController(context=context)
    operator.add_node(controller)
    log = operator.listen_to_log()
    name = '/position_controller/target'
    targets = operator.node.create_publisher(PointStamped, name, 10)
    operator.spin_until(lambda: targets.get_subscription_count() > 0, 'the controller')
    for frame_id, x_m in (('stage_base', 1e-6), ('', 2e-6), ('camera', 3e-6)):
        target = PointStamped()
        target.header.frame_id, target.point.x = frame_id, x_m
        targets.publish(target)
    refusal = (
        "target in frame 'camera', not stage_base; transform it, leave the frame empty, or "
        'change target_frame'
    )
    operator.spin_until(lambda: refusal in log, 'the refusal')
    assert controller.loop._target_m == 2e-6
    controller.destroy_node()
    operator.close()
    context.try_shutdown()


def test_without_lockstep_it_sends_steps_and_voltages_and_offers_no_other_command(
    start_drive: Callable,
):
    stand = start_drive()
    operator, controller = stand.operator, PositionController(context=stand.context)
    operator.add_node(controller)
    for target_m, command in ((1e-6, 'steps'), (50e-9, 'voltage')):
        controller.loop.aim(target_m)
        assert operator.wait_for_event(command, 0)['result'] in {'DONE', 'ABORTED'}
    offered = operator.node.get_publisher_names_and_types_by_node('position_controller', '/')
    commands = {name for name, _ in offered if name.startswith('/command/')}
    assert commands == {'/command/steps', '/command/voltage'}
    controller.destroy_node()


@pytest.fixture
def controlled(start_drive: Callable, tmp_path: Path) -> Iterator[tuple[Any, Any]]:
    """Give a realistic drive and a controller, which go in lockstep."""
    stand = start_drive(
        {
            **REALISTIC,
            'sim.lockstep': True,
            'sim.publish_truth': True,
            'record.on_start': True,
            'record.name': 'controlled.mcap',
        },
        wait=False,
    )
    override = [Parameter('lockstep', value=True)]
    controller = PositionController(context=stand.context, parameter_overrides=override)
    stand.operator.add_node(controller)
    yield stand, controller
    controller.destroy_node()


def test_targets_from_100_nm_to_100_um_are_reached_within_5_nm_and_held_under_load(
    controlled: tuple[Any, Any], tmp_path: Path
):
    stand, controller = controlled
    operator = stand.operator
    truth = stand.operator.listen('truth/position')
    for target_m in TARGETS_M:
        controller.loop.aim(target_m)
        operator.spin_until(lambda: controller.loop.in_position, f'{target_m} m', 60.0)
        enough = len(truth) + 1000 * HOLD_S
        operator.spin_until(lambda n=enough: len(truth) > n, 'the hold')
        held = np.array([m.point.x for m in truth[-int(500 * HOLD_S) :]])
        assert np.abs(held - target_m).max() < TOLERANCE_M
    operator.command('load', LOAD_N)
    loaded = len(truth)
    operator.spin_until(lambda: len(truth) > loaded + 2000 * HOLD_S, 'the hold under load')
    after = np.array([m.point.x for m in truth[loaded:]]) - TARGETS_M[-1]
    assert np.abs(after).max() > TOLERANCE_M  # the load does push the runner away
    assert np.abs(after[-int(500 * HOLD_S) :]).max() < TOLERANCE_M
