# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""``stickslip command``: send a command to a running drive over topics, and wait for its end."""

import argparse
import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from time import monotonic
from typing import Any

from stickslip_ros.errors import OutOfRange, StickSlipError
from stickslip_ros.instrument.commands import Command, typed_command
from stickslip_ros.instrument.reports import Result, Status
from stickslip_ros.interface.requests import BY_TOPIC, pack_command, typed_numbers
from stickslip_ros.lab.cli.printing import Answer
from stickslip_ros.message_types import SET_BOOL
from stickslip_ros.parameters import NODE_NAME
from stickslip_ros.ros.client import drives_of
from stickslip_ros.ros.executable import stay_on_this_host
from stickslip_ros.testing import Operator, open_context
from stickslip_ros.units import MICRO, NANO

EVENT_S = 1e9
"""Longest time of a command, s; Ctrl-C ends the wait."""
LOOK_S, LOOK_MAX_S = 0.6, 1.0
"""
Looks for a second drive in the namespace: from the start of the own node, which Fast DDS announces
for 0.5 s; and at most after the first is met, on a host that is busy, s.

"""
ENDED_BY = re.compile(r'by command (\d+)$')


def command_verb(arguments: argparse.Namespace) -> Answer:
    """Send the command; return its result, or refuse with the reason of the drive."""
    command = typed_command(arguments.name)
    numbers, cycles = typed_numbers(command, arguments.numbers), arguments.cycles
    if command.has_topic:  # refuse numbers that no message can hold before looking for a drive
        pack_command(BY_TOPIC[command.name], numbers, cycles=cycles)
    if cycles != 1 and not command.is_table:
        raise OutOfRange('--cycles', cycles, '', f'not for {command.name}', 'leave it out')
    with _met(arguments) as operator:
        if command.has_service:
            return _call(operator, command, numbers)
        is_moving, before = (operator.status or 0) & Status.MOVING, len(operator.events)
        operator.command(command.name, numbers, cycles)
        if arguments.no_wait:
            operator.shake_hands()  # a later answer: the command has left this process
            return Answer({'command': command.name}, [f'{command.name}: sent'])

        def ended() -> list[dict[str, Any]]:
            return ends(operator.events[before:], command.name, is_moving=bool(is_moving))

        operator.spin_until(lambda: bool(ended()), f'the end of {command.name}', EVENT_S)
        return _answer(command.name, ended()[0])


@contextmanager
def _met(arguments: argparse.Namespace) -> Iterator[Operator]:
    """Give an operator of the named drive, or of the only one in its namespace."""
    stay_on_this_host()
    context = open_context(namespace=arguments.namespace)
    operator = Operator(context, arguments.node or NODE_NAME)
    begun_s = monotonic()
    try:
        if not arguments.node and (name := find(operator, arguments.timeout)) != NODE_NAME:
            operator.close()
            operator = Operator(context, name)
        meet(operator, arguments.timeout)
        if not arguments.node:
            met_s = monotonic() - begun_s
            look_s = min(max(LOOK_S - met_s, met_s / 2.0), LOOK_MAX_S)
            with suppress(StickSlipError):  # none is the usual case
                operator.spin_until(lambda: len(near(operator)) > 1, 'another drive', look_s)
            find(operator, arguments.timeout)
        yield operator
    finally:
        operator.close()
        context.try_shutdown()


def _call(operator: Operator, command: Command, numbers: Sequence[float]) -> Answer:
    """Call the service of a command; refuse a failure with its reason."""
    answer = (
        operator.switch(command.name, bool(numbers[0]))
        if command.interface == SET_BOOL
        else operator.trigger(command.name)
    )
    if not answer.success:
        raise StickSlipError(answer.message)
    return Answer({'command': command.name}, [f'{command.name}: {Result.DONE.name}'])


def _answer(name: str, event: dict[str, Any]) -> Answer:
    """Return the answer of the end of a command; refuse a failure with its reason."""
    outcome = f'{name}: {event["result"]} at {event["time_ns"] * NANO:.9g} s'
    if event['result'] != Result.DONE.name:
        raise StickSlipError(f'{outcome}: {event["message"]}')
    steps = f', {event["steps"]} steps' if event['steps'] else ''
    position_m = event['position_m']
    reading = 'none' if position_m is None else f'{position_m / MICRO:.6g} um'
    return Answer(event, [f'{outcome}{steps}; position reading {reading}'])


def near(operator: Operator) -> list[str]:
    """Return the drives in the namespace of an operator."""
    return drives_of(operator.node, operator.node.get_namespace())


def find(operator: Operator, timeout_s: float) -> str:
    """Wait for a drive in the namespace of an operator; return its name, or refuse several."""
    namespace = operator.node.get_namespace()
    try:
        operator.spin_until(lambda: bool(near(operator)), 'a drive', timeout_s)
    except StickSlipError:
        raise missing(operator, f'in namespace {namespace}', timeout_s) from None
    if len(drives := near(operator)) != 1:
        why = f'namespace {namespace} has {len(drives)} drives: {", ".join(drives)}'
        raise StickSlipError(f'{why}; choose by --node')
    return drives[0].rpartition('/')[2]


def missing(operator: Operator, what: str, timeout_s: float) -> StickSlipError:
    """Return the refusal of a drive that does not answer, with all drives that are seen."""
    domain, seen = operator.node.context.get_domain_id(), ', '.join(drives_of(operator.node))
    hint = 'start one: stickslip drive; or name its --namespace'
    hint = f'seen: {seen}; choose by --namespace and --node' if seen else hint
    why = f'no drive {what} has answered within {timeout_s:g} s in domain {domain}'
    return StickSlipError(f'{why}; {hint}')


def meet(operator: Operator, timeout_s: float) -> None:
    """Wait for the drive; refuse a drive that is missing or not active."""
    place = operator.node.get_namespace().rstrip('/') + f'/{operator.drive}'
    try:
        operator.wait_for_topics(timeout_s)
    except StickSlipError:
        raise missing(operator, place, timeout_s) from None
    state = operator.state()
    if state != 'active':
        raise StickSlipError(f'{place} is {state}, not active; activate it first')
    operator.spin_until(lambda: operator.status is not None and bool(operator.info), 'its status')


def ends(events: Sequence[dict[str, Any]], name: str, *, is_moving: bool) -> list[dict[str, Any]]:
    """Return the end of the sent command; the end of a replaced move comes first."""
    number = None
    for event in events:
        by = ENDED_BY.search(event['message'])
        if is_moving and number is None and by is not None:
            number = int(by[1])
        elif event['command'] == name and number in (None, event['number']):
            return [event]
    return []
