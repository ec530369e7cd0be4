"""Lateness of the node and of bare loops while other processes use the machine."""

import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from functools import partial

from benchmarks.node.cpu import ABOUT_LATENESS, DRIVE, FORMS, OBJECTS, PLAIN, lateness_rows
from benchmarks.node.programs import BareLoop, Drive, Program, in_turn, may_begin_with, opened
from benchmarks.outcome import Outcome
from benchmarks.sizes import Sizes

PLAIN_DRIVE = 'the node, untuned'


def run(sizes: Sizes) -> Outcome:
    """Run nodes and bare loops in turn, with others all the time."""
    makers: list[Callable[[], Program]] = [
        lambda: Drive(DRIVE),
        lambda: Drive(PLAIN_DRIVE, tuned=False),
    ]
    if may_begin_with(sizes.real_time):
        name = f'{DRIVE}, {" ".join(sizes.real_time)}'
        makers.append(lambda: Drive(name, before=sizes.real_time))
    makers += [partial(BareLoop, form, *FORMS[form]) for form in (OBJECTS, PLAIN)]
    with ExitStack() as stack:
        programs = opened(stack, makers)
        stack.enter_context(company(sizes.others))
        turns = in_turn(programs, sizes.node_rounds, sizes.settle_s, sizes.turn_s)
    named = {program.name: its for program, its in zip(programs, turns, strict=True)}
    return Outcome(
        f'Lateness of ticks at 1 kHz beside {sizes.others} processes that compute all the time',
        lateness_rows(named),
        [],
        [
            f'{sizes.node_rounds} turns of {sizes.turn_s:g} s',
            *ABOUT_LATENESS,
            'chrt needs the privilege; where it is missing, so is this row',
        ],
    )


@contextmanager
def company(processes: int) -> Iterator[None]:
    """Have so many processes compute meanwhile."""
    started = [
        subprocess.Popen([sys.executable, '-c', 'while True: pass']) for _ in range(processes)
    ]
    try:
        yield
    finally:
        for process in started:
            process.kill()
        for process in started:
            process.wait()
