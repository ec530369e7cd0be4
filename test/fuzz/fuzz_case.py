# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""One random case: a stand, a program of random commands, and what is asked of their run."""

import math
import shlex
from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from fuzz_stands import drawn, stand_of

from stickslip_ros.drive.ledger import EnergyLedger
from stickslip_ros.drive.records import FORCE, POSITION, TIME
from stickslip_ros.errors import StickSlipError
from stickslip_ros.instrument.bench import Bench
from stickslip_ros.instrument.commands import Request
from stickslip_ros.instrument.joints import Joints
from stickslip_ros.instrument.reports import Event, Result
from stickslip_ros.parameters import FaultParameters, Parameters, Scalar, spec_of
from stickslip_ros.recording.run import ReportingBench, RunWriter

COMMANDS = 12
BLOCKS_BETWEEN = 3
RESTORED_EVERY = 8
"""Commands after which the second run of a case goes on with a bench restored from bytes."""
PASSES_PER_S = 2e8
"""Passes of the loops over time that a simulated second may take."""
RESIDUAL = 3e-3
"""Largest error of the energy balance, relative to all work in and out, and of one presliding."""
DRIVE_CHANGES = {
    'contact.friction': (0.05, 1.0),
    'runner.mass': (3e-4, 0.1),
    'runner.damping': (1.0, 200.0),
}
"""Live parameters of the drive itself, set once in a case at any time."""
AT_REST = EnergyLedger(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)

Numbers = Callable[[np.random.Generator, Parameters], tuple[float, ...]]
Settings = tuple[tuple[str, Scalar], ...]


@dataclass
class Outcome:
    """What a run of a case came to."""

    problems: list[str] = field(default_factory=list)  # empty if all is well
    commands: Counter[str] = field(default_factory=Counter)  # by name


def command_line(stand: str, seed: int) -> str:
    """Return the command that repeats a case."""
    return f'make fuzz ARGS="--stand {shlex.quote(stand)} --case {seed}"'


def run_case(stand: str, seed: int) -> Outcome:
    """Run a case twice, and judge it."""
    rng = np.random.default_rng([seed, *stand.encode()])
    try:
        parameters = stand_of(stand, rng)
    except StickSlipError as error:
        return Outcome([f'the stand is refused: {error}'])
    program = program_of(rng, parameters)
    for name, span in DRIVE_CHANGES.items():
        change = Request('parameters', settings=((name, drawn(rng, span)),))
        program.insert(int(rng.integers(len(program))), (change, 1))
    outcome = Outcome(commands=Counter(request.name for request, _ in program))
    first, second = _Run(parameters), _Run(parameters)
    try:
        first.go(program)
        second.go(program, restored=True)
    except StickSlipError as error:
        outcome.problems.append(str(error))
        return outcome
    outcome.problems += first.problems
    if first.bytes_told != second.bytes_told:
        outcome.problems.append('played again, and restored on the way, it gives other bytes')
    if first.passes_per_s > PASSES_PER_S:
        outcome.problems.append(f'{first.passes_per_s:.3g} passes per simulated second')
    if first.residual > RESIDUAL:
        outcome.problems.append(f'energy balance is {first.residual:.3g} off')
    return outcome


def program_of(rng: np.random.Generator, parameters: Parameters) -> list[tuple[Request, int]]:
    """Draw commands, each with the number of blocks after it."""
    return [
        (_request(rng, parameters), int(rng.integers(BLOCKS_BETWEEN + 1))) for _ in range(COMMANDS)
    ]


def record(parameters: Parameters, program: list[tuple[Request, int]], path: Path) -> None:
    """Record a program in a file."""
    with RunWriter(path, parameters, wait=True) as writer:
        run = ReportingBench(parameters, writer=writer)
        for request, blocks in [*program, (Request('stop'), BLOCKS_BETWEEN)]:
            run.accept(request)
            for _ in range(blocks):
                run.update(run.bench.time_ns + parameters.block_ns)


class _Run:
    """A bench that is led through a program."""

    def __init__(self, parameters: Parameters) -> None:
        self.bench = Bench(parameters)
        self.problems: list[str] = []
        self.bytes_told: list[bytes] = []
        self.residual = 0.0
        self._passes = 0
        self._flow_j = self._presliding_j = 0.0

    def go(self, program: list[tuple[Request, int]], *, restored: bool = False) -> None:
        for number, (request, blocks) in enumerate(program):
            requests = [request]
            if restored and number % RESTORED_EVERY == 1:
                self.bench = Bench.restore(self.bench.save())
            for _ in range(blocks):
                self._update(requests)
                requests = []
            for each in requests:
                self.bench.accept(each)
        self._update([])

    @property
    def passes_per_s(self) -> float:
        return self._passes / (self.bench.time_ns * 1e-9)

    def _update(self, requests: list[Request]) -> None:
        bench = self.bench
        before, made = bench.ledger, bench.state.passes_made
        output = bench.update(bench.time_ns + bench.parameters.block_ns, requests)
        readings, after = output.readings, bench.ledger
        self._passes += bench.state.passes_made - made
        trace = readings.trace[:, TIME:POSITION]
        truth = (readings.truth_position_m, readings.truth_force_n, readings.voltage_v)
        if not (np.isfinite(trace).all() and np.isfinite(truth).all()):
            self.problems.append(f'not finite at {bench.time_ns} ns')
        if np.isinf(readings.trace[:, POSITION : FORCE + 1]).any():
            self.problems.append(f'an infinite reading at {bench.time_ns} ns')
        told: tuple[Event, ...] = output.events
        self.bytes_told += [readings.trace.tobytes(), output.ramps.tobytes(), repr(told).encode()]
        if any(event.command == 'reset' and event.result is Result.DONE for event in told):
            self._flow_j, before = 0.0, AT_REST
        self._flow_j += abs(after.feet_work_j - before.feet_work_j)
        self._flow_j += abs(after.load_work_j - before.load_work_j)
        if not math.isfinite(after.residual_j):
            self.problems.append(f'the energy is not finite at {bench.time_ns} ns')
        elif bench.parameters.contact.law == 'mdr':
            presliding_j = bench.plant.contacts[0].curve.energy_max_j
            self._presliding_j = max(self._presliding_j, presliding_j)
            scale_j = self._flow_j + self._presliding_j
            self.residual = max(self.residual, abs(after.residual_j) / scale_j)


def _request(rng: np.random.Generator, parameters: Parameters) -> Request:
    name = str(rng.choice(sorted((*NUMBERS, *SETTINGS, 'joint'))))
    if name in SETTINGS:
        return Request(name, settings=SETTINGS[name](rng))
    if name == 'joint':
        return Request('joint', joints=_joints(rng))
    numbers = NUMBERS[name](rng, parameters)
    if name == 'waveform' and rng.random() < 0.5:  # closed, as one must be that repeats
        return Request(name, (*numbers[:-1], numbers[1]), cycles=int(rng.integers(0, 6)))
    return Request(name, numbers)


def _joints(rng: np.random.Generator) -> Joints:
    """Draw a target or a velocity, which is now and then beyond what steps reach."""
    if rng.random() < 0.5:
        return Joints((), (_signed(rng, 1e-10, 1e-5),))
    return Joints((), (math.nan,), (_signed(rng, 1e-9, 3e-4),))


def _live(rng: np.random.Generator) -> Settings:
    """Draw soft limits, none now and then, and a velocity."""
    reach_m = float(rng.uniform(1e-7, 1e-5)) * bool(rng.integers(4))
    velocity = ('closed_loop.velocity', float(rng.uniform(0.0, 1e-4)))
    return ('limits.soft_min', -reach_m), ('limits.soft_max', reach_m), velocity


def _faults(rng: np.random.Generator) -> Settings:
    """Draw one fault, or its end."""
    names = [n for n in FaultParameters.__dataclass_fields__ if spec_of(f'fault.{n}').live]
    name = f'fault.{rng.choice(names)}'
    spec = spec_of(name)
    if spec.choices:
        return ((name, str(rng.choice(spec.choices))),)
    if spec.kind is bool:
        return ((name, bool(rng.integers(2))),)
    if spec.kind is int:
        return ((name, int(rng.integers(int(spec.minimum or 0), int(spec.maximum or 0) + 1))),)
    spans = {'fault.missed_steps': 1.0, 'fault.command_delay': 5e-3}
    return ((name, float(rng.uniform(0.0, spans.get(name, 1e-6)))),)


def _voltage(rng: np.random.Generator, parameters: Parameters) -> float:
    amplifier = parameters.amplifier
    return float(rng.uniform(amplifier.voltage_min, amplifier.voltage_max))


def _frequency(rng: np.random.Generator, parameters: Parameters) -> float:
    return drawn(rng, (1.0, parameters.amplifier.frequency_max)) * float(rng.choice([-1.0, 1.0]))


def _sawtooth(rng: np.random.Generator, parameters: Parameters) -> tuple[float, ...]:
    amplifier = parameters.amplifier
    range_v = amplifier.voltage_max - amplifier.voltage_min
    largest_v = drawn(rng, (1e-3, 1.0)) * range_v
    return (largest_v, _frequency(rng, parameters), float(rng.integers(0, 40)))


def _waveform(rng: np.random.Generator, parameters: Parameters) -> tuple[float, ...]:
    """Draw rows that are far apart or dense, and now and then one on top of the other."""
    rows = int(rng.integers(2, 30))
    gaps_s = [drawn(rng, (1e-12 if rng.random() < 0.2 else 1e-6, 3e-3)) for _ in range(rows - 1)]
    times_s = np.concatenate(([0.0], np.cumsum(gaps_s)))
    times_s *= drawn(rng, (0.1, 1e3)) if rng.random() < 0.2 else 1.0
    return tuple(x for t in times_s for x in (float(t), _voltage(rng, parameters)))


def _signed(rng: np.random.Generator, low: float, high: float) -> float:
    return drawn(rng, (low, high)) * float(rng.choice([-1.0, 1.0]))


NUMBERS: Mapping[str, Numbers] = {
    'voltage': lambda rng, p: (_voltage(rng, p),),
    'sawtooth': _sawtooth,
    'steps': lambda rng, _: (float(rng.integers(-50, 51)),),
    'jog': lambda rng, p: (_frequency(rng, p) if rng.random() < 0.9 else 0.0,),
    'waveform': _waveform,
    'position': lambda rng, _: (_signed(rng, 1e-10, 1e-5), 0.0, 0.0),
    'load': lambda rng, _: (_signed(rng, 1e-6, 0.5), 0.0, 0.0, 0.0, 0.0, 0.0),
    'preload': lambda rng, p: (drawn(rng, (0.01, p.stand.preload_limit)),),
    'stop': lambda *_: (),
    'reset': lambda *_: (),
    'zero_position': lambda *_: (),
    'tare_force': lambda *_: (),
    'enable_amplifier': lambda rng, _: (float(rng.random() < 0.8),),
    'clear_faults': lambda *_: (),
}
"""The numbers of each command that has some, or needs none."""
SETTINGS: Mapping[str, Callable[[np.random.Generator], Settings]] = {
    'fault': _faults,
    'parameters': _live,
}
"""The names and values of the commands that take such."""
