# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The action ~/follow_joint_trajectory, as its clients see it."""

import sys
from collections.abc import Callable, Iterator
from typing import Any

import control_types
import pytest
from action_msgs.msg import GoalStatus
from control_types import import_folder, why_not
from rclpy.action import ActionClient

from stickslip_ros.testing import Stand
from stickslip_ros.units import NANO, NS_PER_S

pytestmark = [
    pytest.mark.skipif(bool(why_not()), reason=why_not()),
    pytest.mark.slow,  # builds the types of the action
]

ACTION = 'stickslip_drive/follow_joint_trajectory'
JOINT = 'runner_joint'
SUCCEEDED, CANCELED = GoalStatus.STATUS_SUCCEEDED, GoalStatus.STATUS_CANCELED
ABORTED, EXECUTING = GoalStatus.STATUS_ABORTED, GoalStatus.STATUS_EXECUTING
WAYS_M = (0.0, 1e-6, 3e-6)
FREE = {'load_cell.contact': 'absent', 'runner.damping': 5.0}


@pytest.fixture(scope='module')
def types(pytestconfig: pytest.Config) -> Iterator[Any]:
    """Give the module of the action's type; afterwards it is not installed again."""
    before = {*sys.modules}
    folder = import_folder(pytestconfig.cache.mkdir(control_types.PACKAGE))
    sys.path.insert(0, str(folder))
    from control_msgs import action, msg  # noqa: PLC0415

    yield action.FollowJointTrajectory, msg.JointTolerance
    sys.path.remove(str(folder))
    for name in {*sys.modules} - before:
        if name.partition('.')[0] == control_types.PACKAGE:
            del sys.modules[name]


class Client:
    """Sends goals to a drive, and keeps what it hears of them."""

    def __init__(self, stand: Stand, types: Any) -> None:
        self.stand, self.operator = stand, stand.operator
        self.action, self.tolerance = types
        self.feedback: list[Any] = []
        self.client = ActionClient(self.operator.node, self.action, ACTION)
        self.operator.spin_until(self.client.server_is_ready, 'the action')
        self.operator.shake_hands()

    def goal(self, ways_m: tuple[float, ...], span_s: float = 0.1, names: Any = (JOINT,)) -> Any:
        """Return a goal that goes from place to place, each in the same time."""
        goal = self.action.Goal()
        goal.trajectory.joint_names = list(names)
        for number, way_m in enumerate(ways_m):
            point = point_type()(positions=[way_m])
            set_time(point.time_from_start, number * span_s)
            goal.trajectory.points.append(point)
        return goal

    def send(self, goal: Any) -> Any:
        """Send a goal; return its handle."""
        future = self.client.send_goal_async(goal, feedback_callback=self.feedback.append)
        self.operator.spin_until(future.done, 'an answer to the goal')
        return future.result()

    def result(self, handle: Any) -> tuple[int, int, str]:
        """Wait for the end of a goal; return its status, code and words."""
        assert handle.accepted
        future = handle.get_result_async()
        self.operator.spin_until(future.done, 'the result')
        answer = future.result()
        return answer.status, answer.result.error_code, answer.result.error_string

    def start(self, goal: Any) -> Any:
        """Send a goal; return its handle when it is under way."""
        handle, heard = self.send(goal), len(self.feedback)
        self.operator.spin_until(lambda: len(self.feedback) > heard + 1, 'feedback')
        assert handle.status == EXECUTING
        return handle

    def cancel(self, handle: Any) -> None:
        """Ask for the end of a goal."""
        future = handle.cancel_goal_async()
        self.operator.spin_until(future.done, 'an answer to the cancelling')
        assert future.result().goals_canceling


def point_type() -> Any:
    from trajectory_msgs.msg import JointTrajectoryPoint  # noqa: PLC0415

    return JointTrajectoryPoint


def set_time(duration: Any, time_s: float) -> None:
    duration.sec, duration.nanosec = divmod(round(time_s * NS_PER_S), NS_PER_S)


@pytest.fixture
def client(start_drive: Callable[..., Stand], types: Any) -> Client:
    return Client(start_drive(FREE), types)


def test_a_trajectory_is_followed_and_ends_at_its_last_point(client: Client):
    handle = client.send(client.goal(WAYS_M))
    assert client.result(handle) == (SUCCEEDED, 0, 'in position')
    event = client.operator.wait_for_event('trajectory', 0)
    assert event['result'] == 'DONE'
    assert event['time_ns'] * NANO > 0.2
    client.operator.spin_until(
        lambda: client.operator.time_ns > event['time_ns'], 'positions after the end'
    )
    last_m = client.operator.positions[max(client.operator.positions)]
    assert last_m == pytest.approx(WAYS_M[-1], abs=10e-9)
    feedback = client.feedback[-1].feedback
    [desired_m], [actual_m], [error_m] = (
        getattr(feedback, name).positions for name in ('desired', 'actual', 'error')
    )
    assert feedback.joint_names == [JOINT]
    assert error_m == desired_m - actual_m
    assert WAYS_M[0] <= desired_m <= WAYS_M[-1]
    assert 0.0 < feedback.desired.velocities[0] <= 20.1e-6 or desired_m == WAYS_M[-1]


BAD: tuple[tuple[Callable[[Any], object], int, str], ...] = (
    (lambda goal: goal.trajectory.joint_names.append('other'), -2, 'runner_joint alone'),
    (lambda goal: goal.trajectory.points.clear(), -1, 'at least one point'),
    (lambda goal: set_time(goal.trajectory.points[1].time_from_start, 0.0), -1, 'rising times'),
    (lambda goal: goal.trajectory.points[1].velocities.append(1e-6), -1, 'of point 2'),
    (lambda goal: goal.trajectory.points[1].positions.append(1e-6), -1, 'of point 2'),
    (lambda goal: goal.trajectory.points[1].positions.__setitem__(0, 1e-3), -1, 'step.freq'),
    (lambda goal: setattr(goal.trajectory.header.stamp, 'sec', 1), -3, 's ago by its stamp'),
)


def test_a_goal_that_makes_no_sense_is_aborted_with_words_and_moves_nothing(client: Client):
    for change, code, words in BAD:
        goal = client.goal(WAYS_M)
        change(goal)
        status, told, why = client.result(client.send(goal))
        assert (status, told) == (ABORTED, code)
        assert words in why
    assert not client.operator.events


def test_a_cancelled_goal_ends_when_the_runner_was_stopped(client: Client):
    handle = client.start(client.goal(WAYS_M, 2.0))
    client.cancel(handle)
    status, code, words = client.result(handle)
    assert (status, code) == (CANCELED, 0)
    assert words == 'stopped by command 2'
    assert client.operator.wait_for_event('stop', 0)['result'] == 'DONE'


def test_a_goal_that_waits_for_simulated_time_is_taken_back(client: Client):
    client.operator.switch('set_paused', wanted=True)
    handle = client.send(client.goal(WAYS_M))
    client.cancel(handle)
    assert client.result(handle) == (CANCELED, 0, 'cancelled before it had begun')
    client.operator.switch('set_paused', wanted=False)
    client.operator.spin_for(0.01)
    assert client.stand.drive.session.bench.motion.is_running is False


def test_a_new_goal_replaces_the_one_that_runs(client: Client):
    first = client.start(client.goal(WAYS_M, 2.0))
    second = client.send(client.goal((0.0, 1e-6)))
    assert client.result(first) == (ABORTED, -1, 'replaced by command 2')
    assert client.result(second)[0] == SUCCEEDED


def test_who_cancels_a_goal_that_is_being_replaced_does_not_stop_the_next(client: Client):
    first = client.start(client.goal(WAYS_M, 2.0))
    client.operator.switch('set_paused', wanted=True)
    second = client.send(client.goal((0.0, 1e-6)))
    client.cancel(first)
    client.operator.switch('set_paused', wanted=False)
    assert client.result(first) == (CANCELED, 0, 'replaced by command 2')
    assert client.result(second)[0] == SUCCEEDED


def test_a_goal_that_makes_no_sense_leaves_the_one_that_runs_alone(client: Client):
    first = client.start(client.goal(WAYS_M, 0.5))
    second = client.send(client.goal(WAYS_M, names=('other',)))
    assert client.result(second)[1] == client.action.Result.INVALID_JOINTS
    assert client.result(first)[0] == SUCCEEDED


def test_another_command_ends_a_goal(client: Client):
    handle = client.start(client.goal(WAYS_M, 2.0))
    client.operator.command('voltage', 10.0)
    assert client.result(handle) == (ABORTED, -1, 'replaced by command 2')


def test_a_runner_that_cannot_follow_violates_a_path_tolerance(start_drive, types):
    """The runner of the paper presses on the load cell, and hardly moves."""
    client = Client(start_drive(), types)
    goal = client.goal(WAYS_M)
    goal.path_tolerance = [client.tolerance(name=JOINT, position=0.5e-6)]
    status, code, words = client.result(client.send(goal))
    assert (status, code) == (ABORTED, client.action.Result.PATH_TOLERANCE_VIOLATED)
    assert 'above the path tolerance 5e-07 m; move slower, or allow more' in words


def test_a_runner_that_is_not_there_in_time_violates_the_goal_tolerance(start_drive, types):
    client = Client(start_drive({'limits.blocked_time': 10.0}), types)
    goal = client.goal(WAYS_M)
    set_time(goal.goal_time_tolerance, 0.05)
    status, code, words = client.result(client.send(goal))
    assert (status, code) == (ABORTED, client.action.Result.GOAL_TOLERANCE_VIOLATED)
    assert 's after the end, above the goal tolerance 2e-09 m' in words


def test_a_drive_that_is_deactivated_ends_its_goal_and_takes_no_other(client: Client):
    handle = client.start(client.goal(WAYS_M, 2.0))
    assert client.operator.change_state('deactivate')
    assert client.result(handle)[:2] == (ABORTED, client.action.Result.INVALID_GOAL)
    assert not client.send(client.goal(WAYS_M)).accepted
    assert client.operator.change_state('activate')
    client.operator.spin_for(0.01)
    assert client.stand.drive.session.bench.motion.is_running is False
    assert client.result(client.send(client.goal((0.0, 1e-6))))[0] == SUCCEEDED


def test_a_drive_that_is_shut_down_during_a_goal_answers_it(client: Client):
    handle = client.start(client.goal(WAYS_M, 2.0))
    future = handle.get_result_async()
    client.operator.shake_hands()  # the drive has the question
    assert client.operator.change_state('shutdown')
    client.operator.spin_until(future.done, 'the result')
    assert future.result().result.error_code == client.action.Result.INVALID_GOAL


def test_a_drive_that_is_configured_anew_offers_it_anew(client: Client):
    for transition in ('deactivate', 'cleanup', 'configure', 'activate'):
        assert client.operator.change_state(transition)
    client.operator.spin_until(client.client.server_is_ready, 'the action')
    client.operator.shake_hands()
    assert client.result(client.send(client.goal((0.0, 1e-6))))[0] == SUCCEEDED
