# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""``make fuzz``: random commands on every stand, damaged files, until the time is over."""

import argparse
import os
import sys
import threading
import time
from collections import Counter

from fuzz_cache import try_cache
from fuzz_case import Outcome, command_line, run_case
from fuzz_files import damage_files
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
    stands = [chosen.stand] if chosen.stand else list(STANDS)
    run_case('default', 0)  # compiles
    campaign = Campaign()
    if chosen.case is not None:
        campaign.try_case(stands[0], chosen.case)
    else:
        end_s = time.monotonic() + chosen.seconds
        case = chosen.first
        while time.monotonic() < end_s:
            for stand in stands:
                campaign.try_case(stand, case)
            campaign.try_caches(range(case * CACHES, (case + 1) * CACHES))
            if not chosen.stand:
                campaign.try_checkpoints(case)
                campaign.try_files(case)
            case += 1
    campaign.tell()
    return 1 if campaign.failed else 0


class Campaign:
    """Cases that were tried, and what they came to."""

    def __init__(self) -> None:
        self.failed = self._caches = 0
        self._cases: Counter[str] = Counter()
        self._commands: Counter[str] = Counter()
        self._refused = 0
        self._most = (0.0, '')
        self._worst = (0.0, '')
        self._slowest = (0.0, '')

    def try_case(self, stand: str, case: int) -> None:
        """Run a case; say at once what is wrong with it, and end if it hangs."""
        repeat = command_line(stand, case)
        watchdog = threading.Timer(HANGS_S, _give_up, [repeat])
        watchdog.daemon = True
        watchdog.start()
        start_s = time.process_time()
        outcome = run_case(stand, case)
        self._slowest = max(self._slowest, (time.process_time() - start_s, repeat))
        watchdog.cancel()
        self._note(stand, repeat, outcome)

    def try_caches(self, cases: range) -> None:
        """Damage files of the kernel cache; say at once which one was taken for whole."""
        self._caches += len(cases)
        for case in cases:
            if not try_cache(case):
                self.failed += 1
                print(
                    f'FAILED: try_cache({case}): a damaged kernel is taken for whole', flush=True
                )

    def try_checkpoints(self, first: int) -> None:
        """Try some of the checkpoints of which one value is wrong, others in each round."""
        for drive in DRIVES:
            for failure in failures_of(drive, first % CHECKPOINTS_EVERY, CHECKPOINTS_EVERY):
                self.failed += 1
                print(f'FAILED: {failure}', flush=True)

    def try_files(self, case: int) -> None:
        """Damage files of each reader."""
        self.failed += damage_files(range(case * FILES, (case + 1) * FILES))

    def _note(self, stand: str, repeat: str, outcome: Outcome) -> None:
        self._cases[stand] += 1
        self._commands += outcome.commands
        self._refused += outcome.refused
        self._most = max(self._most, (outcome.passes_per_s, repeat))
        self._worst = max(self._worst, (outcome.residual, repeat))
        if outcome.problems:
            self.failed += 1
            print(f'FAILED: {"; ".join(outcome.problems[:3])}\n  {repeat}', flush=True)
        elif sys.stderr.isatty():
            sys.stderr.write(f'\r{self._cases.total()} cases, {self.failed} failed\r')

    def tell(self) -> None:
        """Print what was tried and what was found."""
        commands = self._commands
        print(f'{self._cases.total()} cases on {len(self._cases)} stands, {self.failed} failed')
        print(f'{self._caches} damaged files of the kernel cache')
        print(f'{commands.total()} commands, each run twice; {self._refused} refused')
        print(f'least of a stand: {min(self._cases.values())} cases')
        print('of each command: ' + ', '.join(f'{n} {commands[n]}' for n in sorted(commands)))
        print(f'most passes per simulated second: {self._most[0]:.3g}  ({self._most[1]})')
        print(f'worst energy balance: {self._worst[0]:.2g}  ({self._worst[1]})')
        print(f'slowest case: {self._slowest[0]:.1f} s of processor time  ({self._slowest[1]})')


def _give_up(repeat: str) -> None:
    """End the process: a kernel that hangs lets other threads run, but hears no signal."""
    print(f'FAILED: hangs, more than {HANGS_S:g} s\n  {repeat}', flush=True)
    os._exit(1)


if __name__ == '__main__':
    sys.exit(main())
