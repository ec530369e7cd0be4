"""The node against the virtual stage, over topics and in lockstep."""

import pytest
from rclpy.executors import SingleThreadedExecutor
from rclpy.parameter import Parameter
from scan_controller.loop import ScanController
from scan_controller.node import ScanControllerNode

from stickslip_ros import Bench, Parameters, Request

STAND = {'load_cell.contact': 'absent', 'runner.damping': 5.0, 'interferometer.latency': 2e-5}
TARGET_M = 20e-9
BLOCKS = 100
HEAP = 30
"""Readings that wait while the node does not run, as beside a busy program."""


@pytest.fixture
def stand(start_drive):
    """Give a drive in lockstep."""
    return start_drive({**STAND, 'sim.lockstep': True})


def readings_m(parameters, controller):
    """Return the readings of the controller at work without ROS, m."""
    bench, requests, read_m = Bench(parameters), [], []
    for _ in range(BLOCKS):
        output = bench.update(bench.time_ns + parameters.block_ns, requests)
        read_m.append(output.readings.position_m)
        voltage_v = controller.update(1e6 * (TARGET_M - read_m[-1]))
        requests = [Request('voltage', (voltage_v,))]
    return read_m


def test_the_node_does_to_the_bit_what_its_controller_does_without_ros(stand):
    stand.run_lockstep(ScanControllerNode(), 0.1)
    expected_m = readings_m(Parameters().updated(STAND), ScanController())
    assert list(stand.operator.positions.values()) == expected_m


def test_the_stage_is_at_its_target_within_50_ms_and_stays_under_a_load(stand):
    node = ScanControllerNode()
    stand.run_lockstep(node, 0.05)
    assert stand.operator.positions[50_000_000] == pytest.approx(TARGET_M, abs=1e-9)
    stand.operator.command('load', 0.01)
    node.set_parameters([Parameter('target', value=30e-9)])
    stand.run_lockstep(node, 0.05)
    assert stand.operator.positions[100_000_000] == pytest.approx(30e-9, abs=1e-9)


def test_without_a_reading_the_last_voltage_stays(stand):
    node = ScanControllerNode()
    stand.run_lockstep(node, 0.05)
    assert stand.operator.set_parameter('fault.interferometer', 'dropout').successful
    stand.run_lockstep(node, 0.01)
    stand.operator.set_parameter('fault.interferometer', 'none')
    stand.run_lockstep(node, 0.05)
    assert stand.operator.positions[110_000_000] == pytest.approx(TARGET_M, abs=1e-9)


def test_readings_that_come_in_heaps_do_not_wind_it_up(stand):
    node, operator = ScanControllerNode(), stand.operator
    stand.run_lockstep(node, 0.001)
    executor = SingleThreadedExecutor(context=node.context)
    executor.add_node(node)
    for last_ms in range(1 + HEAP, 40 * HEAP, HEAP):
        operator.command('grant', (1e-3 * last_ms, stand.drive.session.received))
        operator.spin_until(lambda end=last_ms: operator.time_ns == 1_000_000 * end, 'the heap')
        for _ in range(3 * HEAP):
            executor.spin_once(timeout_sec=0.0)
    read_m = list(operator.positions.values())
    assert max(read_m) < TARGET_M + 1e-9
    assert read_m[-1] == pytest.approx(TARGET_M, abs=1e-9)
