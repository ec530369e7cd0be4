# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""A rig of topics and a twin beside it, over DDS."""

import threading
from collections.abc import Iterator

import numpy as np
import pytest
from geometry_msgs.msg import PointStamped
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.parameter import Parameter

from stickslip_ros.lab.experiments.experiment import Experiment, Seen, Voltage
from stickslip_ros.lab.experiments.predict import predict
from stickslip_ros.lab.twin.node import StickSlipTwin
from stickslip_ros.parameters import Parameters
from stickslip_ros.ros.client import open_context
from stickslip_ros.ros.executable import end_node
from stickslip_ros.testing.operator import Operator

RATE_HZ, CYCLES, HZ, VOLTS, NOISE_M = 2e3, 175, 500.0, 300.0, 1.5e-9
MAP = 'voltage_v=/rig/amplifier.point.x, position_m=/rig/encoder.point.x (nm)'
STAND = {'runner.damping': 20.0, 'load_cell.contact': 'absent'}
WAIT_S = 60.0


@pytest.fixture
def twin(ros_domain: int) -> Iterator[StickSlipTwin]:
    """Give a twin of a rig of topics, whose executor has a thread of its own."""
    context = open_context(ros_domain)
    settings = {'twin.map': MAP, 'twin.window': 0.1, 'twin.frequency_max': 1000.0}
    given = {**STAND, **settings, 'twin.free': 'contact.friction, actuator.gain'}
    node = StickSlipTwin(
        context=context,
        parameter_overrides=[Parameter(name, value=value) for name, value in given.items()],
    )
    executor, ended = SingleThreadedExecutor(context=context), threading.Event()
    executor.add_node(node)

    def spin() -> None:
        while not ended.is_set():
            executor.spin_once(timeout_sec=0.02)

    thread = threading.Thread(target=spin)
    thread.start()
    yield node
    ended.set()
    thread.join()
    end_node(executor, node)
    context.try_shutdown()


@pytest.fixture
def operator(ros_domain: int) -> Iterator[Operator]:
    context: Context = open_context(ros_domain)
    operator = Operator(context)
    yield operator
    operator.close()
    context.try_shutdown()


def motion() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Give times, voltage and positions of a stand like that of the twin, with noise."""
    fall_s, starts_s = 2e-6, np.arange(CYCLES) / HZ
    corners = [(s + t, v) for s in starts_s for t, v in ((0.0, 0.0), (1.0 / HZ - fall_s, VOLTS))]
    rows = np.array([*corners, (CYCLES / HZ, 0.0)])
    time_s = np.arange(1.7e-4, rows[-1, 0], 1.0 / (2.585 * RATE_HZ))
    seen = Seen('position_m', np.zeros(len(time_s)), time_s)
    [[found]] = predict(Parameters().updated(STAND), [Experiment('', {}, Voltage(rows), (seen,))])
    noise_m = np.random.default_rng(1).normal(0.0, NOISE_M, len(time_s))
    return time_s, np.interp(time_s, *rows.T), found.values + noise_m


def test_a_rig_of_topics_has_a_twin_that_moves_with_it(twin: StickSlipTwin, operator: Operator):
    rig = operator.node
    amplifier, encoder = (
        rig.create_publisher(PointStamped, f'/rig/{name}', 10_000)
        for name in ('amplifier', 'encoder')
    )
    heard: dict[str, list] = {'twin/residual': [], 'twin/parameters': [], 'twin/steps': []}
    for key, into in heard.items():
        [publisher] = [each for each in twin.publishers if each.topic_name == f'/{key}']
        rig.create_subscription(publisher.msg_type, f'/{key}', into.append, 10_000)

    def is_joined() -> bool:
        return bool(
            amplifier.get_subscription_count()
            and encoder.get_subscription_count()
            and all(rig.count_publishers(f'/{key}') for key in heard)
        )

    operator.spin_until(is_joined, 'the twin', WAIT_S)
    for time_s, voltage_v, position_m in zip(*motion(), strict=True):
        for publisher, value in ((amplifier, voltage_v), (encoder, 1e9 * position_m)):
            message = PointStamped()
            message.header.stamp.sec, message.header.stamp.nanosec = 7, round(1e9 * time_s)
            message.point.x = float(value)
            publisher.publish(message)
    operator.spin_until(lambda: bool(heard['twin/parameters']), 'a fit', WAIT_S)
    operator.spin_until(lambda: len(heard['twin/steps']) >= 2, 'its windows', WAIT_S)
    _, steps, rig_m, twin_m, rms_m = heard['twin/steps'][0].data
    assert steps in (48.0, 49.0)
    assert twin_m == pytest.approx(rig_m, rel=3e-3, abs=0.0)
    assert rms_m < 3.0 * NOISE_M
    labels = heard['twin/parameters'][0].layout.dim[1].label.split(',')
    found = dict(zip(labels, heard['twin/parameters'][0].data, strict=True))
    friction = found['contact.friction'], found['contact.friction_sigma']
    assert friction[0] == pytest.approx(0.3, rel=0.0, abs=4.0 * friction[1])
    assert friction[1] < 0.03
    stamps = [each.header.stamp for each in heard['twin/residual']]
    assert all(each.sec == 7 for each in stamps)
