"""
A position controller at work over topics, on a stand with the faults of real hardware.

Drive and controller go in lockstep; the run is recorded, judged by its true position and drawn:
``python docs/examples/positioning.py`` writes ``runs/positioning.mcap`` and ``.png``.

"""

import os
import subprocess
from contextlib import closing
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from geometry_msgs.msg import Point, PointStamped
from std_msgs.msg import Bool

from stickslip_ros import load_yaml, open_run
from stickslip_ros.testing import Stand, reserve_domain

STAND = Path(__file__).parents[2] / 'config' / 'realistic.yaml'
TARGETS_M = (100e-9, 1e-6, 10e-6, 100e-6)
LOAD_N = 0.05
HOLD_S = 0.4
SETTLE_S = 0.2
"""Time that the controller has to take back what the load pushed."""
STYLE = {'figsize': (11.0, 7.5), 'layout': 'constrained'}
CONTROLLER = ('position_controller', '--ros-args', '-p', 'lockstep:=true')


def visit(operator, targets_m):
    """Go to targets, m, and load the last one; give when each was asked for, held and left, s."""
    node, arrivals, legs = operator.node, [], []
    target = node.create_publisher(PointStamped, 'position_controller/target', 10)
    name = 'position_controller/in_position'
    node.create_subscription(Bool, name, lambda message: arrivals.append(message.data), 10)
    both_ends = (target.get_subscription_count, lambda: node.count_publishers(name))
    operator.spin_until(lambda: all(end() for end in both_ends), 'the controller', 120.0)
    for target_m in targets_m:
        start_s = operator.time_ns / 1e9
        arrivals.clear()
        target.publish(PointStamped(point=Point(x=target_m)))
        operator.spin_until(lambda: True in arrivals, f'{target_m:g} m', 120.0)
        held_s = operator.time_ns / 1e9
        operator.spin_for(HOLD_S)
        legs.append((start_s, held_s, operator.time_ns / 1e9, target_m))
    start_s = operator.time_ns / 1e9
    operator.command('load', LOAD_N)
    operator.spin_for(SETTLE_S + HOLD_S)
    legs.append((start_s, start_s + SETTLE_S, operator.time_ns / 1e9, target_m))
    return legs


def draw(run, truth, legs):
    """Draw the true position, its distance from the targets, and the voltage over time."""
    figure, (position, error, voltage) = plt.subplots(3, sharex=True, **STYLE)
    position.plot(truth.time_s, 1e6 * truth.value)
    position.set_yscale('symlog', linthresh=0.1)
    position.set_ylabel('true position (um)')
    for start_s, _, end_s, target_m in legs:
        position.hlines(1e6 * target_m, start_s, end_s, 'black', 'dashed')
        part = truth.window(start_s, end_s)
        error.semilogy(part.time_s, 1e9 * np.abs(part.value - target_m) + 0.01, color='C1')
    error.axhline(5.0, color='black', linestyle='dashed')
    error.set_ylabel('distance from target (nm)')
    voltage.plot(run.frame.index, run.frame['voltage_v'])
    voltage.set_ylabel('piezo voltage (V)')
    voltage.set_xlabel('simulated time (s)')
    return figure


def main(targets_m=TARGETS_M, folder='runs'):
    """Run, judge, draw; return the largest true error of each hold, m."""
    recording = Path(folder, 'positioning.mcap')
    recording.unlink(missing_ok=True)
    switches = {'sim.lockstep': True, 'sim.publish_truth': True, 'record.on_start': True}
    files = {'record.directory': str(folder), 'record.name': recording.name}
    with reserve_domain() as domain:
        parameters = load_yaml(STAND).changed() | switches | files
        with closing(Stand(domain, parameters)) as stand:
            stand.operator.wait_for_topics()
            environment = {'ROS_DOMAIN_ID': str(domain)}
            controller = subprocess.Popen(CONTROLLER, env=os.environ | environment)
            try:
                legs = visit(stand.operator, targets_m)
            finally:
                controller.terminate()
                controller.wait()
    run = open_run(recording)
    truth = run.recording.series('truth/position')
    draw(run, truth, legs).savefig(recording.with_suffix('.png'))
    errors_m = []
    for start_s, held_s, end_s, target_m in legs:
        errors_m.append(np.abs(truth.window(held_s, end_s).value - target_m).max())
        way_ms, error_nm = 1e3 * (held_s - start_s), 1e9 * errors_m[-1]
        print(f'{1e9 * target_m:g} nm: held after {way_ms:.0f} ms, within {error_nm:.2f} nm')
    return errors_m


if __name__ == '__main__':
    main()
