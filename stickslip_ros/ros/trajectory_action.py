# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The action ``~/follow_joint_trajectory``, offered if its type is installed."""

from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import Future
from contextlib import suppress
from dataclasses import replace
from importlib import import_module
from typing import Any

from rclpy.action import ActionServer, CancelResponse, GoalResponse
from rclpy.action.server import ServerGoalHandle
from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from rclpy.duration import Duration
from rclpy.lifecycle import LifecycleNode
from rclpy.time import Time

from stickslip_ros.errors import OutOfRange, StickSlipError, UnknownName, WrongKind
from stickslip_ros.instrument.commands import TRAJECTORY, Request, check_request
from stickslip_ros.instrument.reports import Event, Result
from stickslip_ros.interface.topics import TRAJECTORY_ACTION
from stickslip_ros.parameters import Parameters
from stickslip_ros.ros.client import stamp_ns
from stickslip_ros.ros.guard import Summons
from stickslip_ros.runtime.orders import AT_ONCE
from stickslip_ros.runtime.session import Session, await_reply
from stickslip_ros.units import NANO, NS_PER_S

FEEDBACK_RATE_HZ = 20.0
"""Rate of feedback in wall-clock time: `action_monitor_rate` of joint_trajectory_controller."""
CODES = {
    Result.DONE: 'SUCCESSFUL',
    Result.FOLLOWING_LIMIT_REACHED: 'PATH_TOLERANCE_VIOLATED',
    Result.END_STOP_REACHED: 'PATH_TOLERANCE_VIOLATED',
    Result.TIMEOUT: 'GOAL_TOLERANCE_VIOLATED',
}
"""Codes of the results of a trajectory; any other result is INVALID_GOAL."""


class TooLate(StickSlipError):
    """A trajectory that has already ended."""


def installed_types() -> tuple[Any, Any] | None:
    """Return the types of the action and of a trajectory's point, if they are installed."""
    try:
        action, points = import_module('control_msgs.action'), import_module('trajectory_msgs.msg')
    except ImportError:
        return None
    return action.FollowJointTrajectory, points.JointTrajectoryPoint


def read_goal(goal: Any, parameters: Parameters, now_ns: int, time_origin_ns: int) -> Request:
    """
    Return the command that carries out a goal; ``now_ns`` is simulated time.

    Raises UnknownName if the goal names another joint than that of the drive; TooLate if its end
    is past; StickSlipError if the goal is malformed, or the drive refuses it.

    """
    trajectory, own = goal.trajectory, parameters.sim.joint_name
    if list(trajectory.joint_names) != [own]:
        names = ', '.join(trajectory.joint_names)
        raise UnknownName('joint', names, f'name {own} alone, sim.joint_name of this drive')
    points = list(trajectory.points)
    if not points:
        raise WrongKind('trajectory', [], 'a list of points', 'send at least one point')
    given = _given_arrays(points)
    rows = [(_seconds(each.time_from_start), *map(sum, _arrays(each)[:3])) for each in points]
    settings: list[tuple[str, Any]] = [('degree', 2 * given - 1)]
    start_ns = stamp_ns(trajectory)
    if start_ns:
        start_ns -= time_origin_ns
        over_s = (now_ns - start_ns) * NANO - rows[-1][0]
        if over_s > 0.0:
            raise TooLate(
                f'the trajectory ended {over_s:.6g} s ago by its stamp; leave the stamp at 0 to '
                'start at once'
            )
        settings.append(('start', start_ns * NANO))
    for name in ('path_tolerance', 'goal_tolerance'):
        settings += ((name, value) for value in _tolerances(name, getattr(goal, name), own))
    settings += [('goal_time_tolerance', s) for s in [_seconds(goal.goal_time_tolerance)] if s]
    values = tuple(number for row in rows for number in row)
    request = Request(TRAJECTORY, values, tuple(settings))
    check_request(request, parameters)
    return request


def _given_arrays(points: list[Any]) -> int:
    """Return how many arrays each point fills: positions, velocities, accelerations."""
    counts = [tuple(map(len, _arrays(point))) for point in points]
    if counts[0] not in ((1, 0, 0, 0), (1, 1, 0, 0), (1, 1, 1, 0)) or len(set(counts)) > 1:
        number = next((k for k, each in enumerate(counts, 1) if each != counts[0]), 1)
        expected = '[1, 0, 0, 0], [1, 1, 0, 0] or [1, 1, 1, 0], the same in all points'
        hint = 'fill positions, velocities, accelerations, in this order; leave effort empty'
        sizes = list(counts[number - 1])
        raise WrongKind(f'sizes of the arrays of point {number}', sizes, expected, hint)
    return sum(counts[0])


def _arrays(point: Any) -> tuple[Any, ...]:
    return point.positions, point.velocities, point.accelerations, point.effort


def _seconds(duration: Any) -> float:
    return float((duration.sec * NS_PER_S + duration.nanosec) * NANO)


def _tolerances(name: str, tolerances: Any, own: str) -> Iterator[float]:
    """Yield the tolerances of the position of the joint; refuse others."""
    for each in tolerances:
        if each.name != own:
            raise UnknownName(f'joint of {name}', each.name, f'name {own}')
        for kind, unit in (('velocity', 'm/s'), ('acceleration', 'm/s2')):
            value = getattr(each, kind)
            if value > 0.0:
                limit = 'not supported, as the runner moves in steps'
                raise OutOfRange(f'{name} {kind}', value, unit, limit, 'set it to 0')
        if each.position:
            yield float(each.position)


class _Server(ActionServer):  # type: ignore[misc]
    """
    An action server without a coroutine for each goal.

    rclpy calls a waiting coroutine again and again, which would take a whole processor.

    """

    def notify_execute(self, goal_handle: Any, execute_callback: Any) -> None:
        """Leave a goal in the state EXECUTING until it is answered."""

    def answer(self, goal: ServerGoalHandle, conclude: Callable[[ServerGoalHandle], Any]) -> None:
        """End a goal by ``conclude``, which returns its result."""
        with suppress(StopIteration):
            self._execute_goal(conclude, goal).send(None)


class TrajectoryAction:
    """
    The goals of a drive, each carried out as one of its commands.

    A malformed goal is accepted and aborted: only a result can give the reason. ``get_session``
    returns the running drive, or refuses.

    """

    def __init__(
        self,
        node: LifecycleNode,
        types: tuple[Any, Any],
        get_session: Callable[[], Session],
        on_refusal: Callable[[str, object], None],
    ) -> None:
        self._node = node
        self._type, self._point = types
        self._get_session = get_session
        self._on_refusal = on_refusal
        # Running goals, the newest last, and the replies to their commands, by tag.
        self._goals: dict[str, tuple[ServerGoalHandle, Future[None]]] = {}
        self._ended: deque[Event] = deque()
        self._is_closing = False
        self._answer_soon = Summons(node, self._answer_ended)
        clock = Clock(clock_type=ClockType.STEADY_TIME)
        self._timer = node.create_timer(1.0 / FEEDBACK_RATE_HZ, self._send_feedback, clock=clock)
        self._timer.cancel()
        self._server = _Server(
            node,
            self._type,
            TRAJECTORY_ACTION.name,
            lambda _: None,
            goal_callback=self._judge,
            handle_accepted_callback=self._begin,
            cancel_callback=self._cancel,
        )

    def on_event(self, event: Event) -> None:
        """Handle the end of a command, on any thread."""
        if event.command == TRAJECTORY and event.tag in self._goals:
            self._ended.append(event)
            self._answer_soon.send()

    def stop(self, session: Session) -> None:
        """Stop the motion before a halt; it would continue at the next activation."""
        if self._goals and session.failure is None:
            with suppress(StickSlipError):
                await_reply(session.submit(Request('stop'), AT_ONCE))

    def give_up(self, why: str) -> None:
        """Abort the goals whose commands will not end."""
        self._ended.extend(_aborted(tag, why) for tag in self._goals)
        self._answer_ended()

    def close(self) -> None:
        """Withdraw the action after the executor has sent the last results."""
        self._is_closing = True
        self._answer_soon.send()

    def _judge(self, _: Any) -> GoalResponse:
        try:
            self._get_session()
        except StickSlipError as error:
            self._refuse(error)
            return GoalResponse.REJECT
        return GoalResponse.ACCEPT

    def _refuse(self, error: StickSlipError) -> None:
        self._on_refusal(TRAJECTORY_ACTION.name.removeprefix('~/'), error)

    def _begin(self, goal: ServerGoalHandle) -> None:
        """Pass a goal to the drive, where it replaces the present motion; or abort it."""
        goal.execute()
        code = 'INVALID_GOAL'
        try:
            session = self._get_session()
            now_ns, origin_ns = session.bench.time_ns, session.worker.time_origin_ns
            request = read_goal(goal.request, session.parameters, now_ns, origin_ns)
        except StickSlipError as error:
            kinds = {UnknownName: 'INVALID_JOINTS', TooLate: 'OLD_HEADER_TIMESTAMP'}
            self._refuse(error)
            self._answer(goal, kinds.get(type(error), code), str(error))
            return
        tag = bytes(goal.goal_id.uuid).hex()
        self._goals[tag] = goal, Future()  # its end may come before the reply
        self._goals[tag] = goal, session.submit(replace(request, tag=tag))
        self._timer.reset()

    def _cancel(self, goal: ServerGoalHandle) -> CancelResponse:
        """Stop the motion, or withdraw the pending command; its end answers the goal."""
        tag = bytes(goal.goal_id.uuid).hex()
        if tag in self._goals and self._goals[tag][1].cancel():
            self._ended.append(_aborted(tag, 'cancelled before it had begun'))
            self._answer_soon.send()
            return CancelResponse.ACCEPT
        if tag == next(reversed(self._goals), ''):  # an older goal is already being replaced
            with suppress(StickSlipError):
                self._get_session().submit(Request('stop'), AT_ONCE)
        return CancelResponse.ACCEPT

    def _answer_ended(self) -> None:
        """Answer the goals whose commands have ended; then close if asked to."""
        while self._ended:
            event = self._ended.popleft()
            if event.tag in self._goals:
                goal, _ = self._goals.pop(event.tag)
                self._answer(goal, CODES.get(event.result, 'INVALID_GOAL'), event.message)
        if not self._goals:
            self._timer.cancel()
        if self._is_closing:
            self._server.destroy()
            self._node.destroy_timer(self._timer)
            self._node.destroy_timer(self._answer_soon.timer)

    def _answer(self, goal: ServerGoalHandle, code: str, why: str) -> None:
        def conclude(goal: ServerGoalHandle) -> Any:
            result = self._type.Result(error_code=getattr(self._type.Result, code))
            result.error_string = why or 'in position'
            if code == 'SUCCESSFUL':
                goal.succeed()
            elif goal.is_cancel_requested:
                result.error_code = self._type.Result.SUCCESSFUL
                goal.canceled()
            else:
                goal.abort()
            return result

        self._server.answer(goal, conclude)

    def _send_feedback(self) -> None:
        """Send the desired and the actual position of the runner to the newest goal."""
        session = self._get_session()
        followed = session.bench.motion.followed
        if followed is None or not self._goals:
            return
        elapsed_s, wanted, position_m = followed
        feedback = self._type.Feedback(joint_names=[session.parameters.sim.joint_name])
        at_ns = session.worker.time_origin_ns + round(wanted.time_s / NANO)
        feedback.header.stamp = Time(nanoseconds=at_ns).to_msg()
        feedback.desired = self._point(
            positions=[wanted.position_m], velocities=[wanted.velocity_m_per_s]
        )
        feedback.actual = self._point(positions=[position_m])
        feedback.error = self._point(positions=[wanted.position_m - position_m])
        for each in (feedback.desired, feedback.actual, feedback.error):
            each.time_from_start = Duration(seconds=elapsed_s).to_msg()
        *_, (goal, _) = self._goals.values()
        goal.publish_feedback(feedback)


def _aborted(tag: str, why: str) -> Event:
    """Return the end of a command that the drive will not report."""
    return Event(0, 0, TRAJECTORY, Result.ABORTED, message=why, tag=tag)
