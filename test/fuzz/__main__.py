# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""``make fuzz``: random commands on every stand, damaged files, until the time is over."""

import argparse
import os
import sys
import threading
import time
from collections import Counter

from fuzz_case import command_line, run_case
from fuzz_files import damage_files, try_cache
from fuzz_stands import STANDS
from wrong_checkpoints import DRIVES, failures_of

CACHES = 20
"""Damaged files of the kernel cache per round of the stands."""
FILES = 5
"""Damaged files of each reader per round."""
CHECKPOINTS_EVERY = 101
"""Of so many wrong checkpoints of a drive one is tried in a round."""
HANGS_S = 120.0
"""A case that takes longer has hung; the longest take a few seconds."""


def main() -> int:
    """Run one case, or as many as the time allows, stand by stand; 1 if any of them failed."""
    parser = argparse.ArgumentParser(prog='make fuzz', description=main.__doc__)
    parser.add_argument('--seconds', type=float, default=60.0, help='default: %(default)g')
    parser.add_argument('--first', type=int, default=1, metavar='N', help='number of first case')
    parser.add_argument('--stand', choices=STANDS, metavar='NAME', help='this stand only')
    parser.add_argument('--case', type=int, metavar='N', help='this case only; needs --stand')
    chosen = parser.parse_args()
    run_case('default', 0)  # compiles
    if chosen.case is not None:
        return try_case(chosen.stand or 'default', chosen.case)[1]
    end_s, commands = time.monotonic() + chosen.seconds, Counter[str]()
    case, failed = chosen.first, 0
    while time.monotonic() < end_s:
        for stand in [chosen.stand] if chosen.stand else STANDS:
            found, is_wrong = try_case(stand, case)
            commands, failed = commands + found, failed + is_wrong
        if not chosen.stand:
            failed += try_others(case)
        case += 1
    print(f'{case - chosen.first} cases of each stand, {failed} failed')
    print('commands: ' + ', '.join(f'{n} {commands[n]}' for n in sorted(commands)))
    return int(failed > 0)


def try_case(stand: str, case: int) -> tuple[Counter[str], int]:
    """Run a case; say what is wrong with it, end if it hangs; return its commands, and 1 if so."""
    repeat = command_line(stand, case)
    watchdog = threading.Timer(HANGS_S, _give_up, [repeat])
    watchdog.daemon = True
    watchdog.start()
    outcome = run_case(stand, case)
    watchdog.cancel()
    if outcome.problems:
        print(f'FAILED: {"; ".join(outcome.problems[:3])}\n  {repeat}', flush=True)
    return outcome.commands, int(bool(outcome.problems))


def try_others(case: int) -> int:
    """Try damaged kernels, wrong checkpoints and damaged files, others in each round."""
    told = [
        f'try_cache({each}): a damaged kernel is taken for whole'
        for each in range(case * CACHES, (case + 1) * CACHES)
        if not try_cache(each)
    ]
    for drive in DRIVES:
        told += failures_of(drive, case % CHECKPOINTS_EVERY, CHECKPOINTS_EVERY)
    for each in told:
        print(f'FAILED: {each}', flush=True)
    return len(told) + damage_files(range(case * FILES, (case + 1) * FILES))


def _give_up(repeat: str) -> None:
    """End the process: a kernel that hangs lets other threads run, but hears no signal."""
    print(f'FAILED: hangs, more than {HANGS_S:g} s\n  {repeat}', flush=True)
    os._exit(1)


if __name__ == '__main__':
    sys.exit(main())
