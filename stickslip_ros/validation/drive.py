"""Checks of the drive, case by case: the algorithm of the paper, springs in small steps."""

from dataclasses import dataclass, field

import numpy as np

from stickslip_ros.drive.advance import RAMP_END, RAMP_MEAN
from stickslip_ros.drive.build import (
    change_preload,
    gain_ratios,
    plant_of,
    start_clock,
    state_at_rest,
)
from stickslip_ros.drive.ledger import energies_of_contacts
from stickslip_ros.drive.waveform import sawtooth
from stickslip_ros.parameters import Parameters
from stickslip_ros.study.sawtooth_run import advance_cycles
from stickslip_ros.units import NM
from stickslip_ros.validation.checks import (
    Curve,
    Family,
    Measured,
    Panel,
    Tolerance,
    measures,
    shared,
)
from stickslip_ros.validation.spring_drive import PERIOD_S, SPRINGS, Motion, Values, run_springs

CYCLES = 8
VOLTAGE_V = 243.75
"""130 nm."""
FREE: Values = {'load_cell.contact': 'absent'}
ONE_SIDED: Values = {'load_cell.contact': 'one_sided', 'load_cell.gap': 1e-7}
RISES: Values = {'stand.preload': 0.3, 'stand.preload_end': 1.0, 'stand.preload_rate': 100.0}
FALLS: Values = {'stand.preload': 1.0, 'stand.preload_end': 0.3, 'stand.preload_rate': 100.0}
RINGS: Values = {'actuator.resonance': 1.5e5, 'actuator.damping_ratio': 0.1}


@dataclass(frozen=True, eq=False)
class Case:
    """A drive under a saw-tooth: parameters that are not the default, amplitude (V), load (N)."""

    name: str
    changes: Values = field(default_factory=dict)
    voltage_v: float = VOLTAGE_V
    load_n: float = 0.0

    def __str__(self) -> str:
        """Return what stands in the names of its checks."""
        return self.name


CASES = (
    Case('fixed to the load cell'),
    Case('backwards', voltage_v=-VOLTAGE_V),
    Case('smooth', {'contact.profile': 'smooth'}),
    Case('damped', {'runner.damping': 80.0}),
    Case('loaded', load_n=-0.05),
    Case('one-sided load cell', ONE_SIDED),
    Case('free', FREE),
    Case('free, backwards', FREE, -VOLTAGE_V),
    Case('free, loaded', FREE, load_n=-0.02),
    Case('weight at 0.1 N', {'stand.weight': True, 'stand.preload': 0.1}),
    Case('preload rises', RISES),
    Case('preload falls', FALLS),
    Case('unequal feet', {'actuator.gain_tolerance': 0.2}),
    Case('slow amplifier', {'amplifier.slew_rate': 25e6}),
    Case('converter', {'amplifier.resolution': 5.0}),
    Case('low-pass', {'amplifier.bandwidth': 5e4}),
    Case('hysteresis', {'actuator.hysteresis': 0.15}),
    Case('creep', {'actuator.creep': 0.05}),
    Case('resonance', RINGS),
)
LITERAL = f'springs, 2 x {SPRINGS} a contact, steps of 20 and 250 ns'
DRIVE_ERROR = Tolerance(
    5e-4, 'steps of 5 us (ideal) and 0.6 us, the spring bank on ramps: seen 3.5e-4'
)
LARGEST = 'the largest'


@shared
def both_motions(case: Case) -> tuple[Motion, Motion]:
    """Return what springs and package make of a case."""
    parameters = Parameters().updated(case.changes)
    ratios = gain_ratios(parameters.actuator.gain_tolerance, parameters.sim.seed)
    literal = run_springs(case.changes, case.voltage_v, CYCLES, case.load_n, ratios)
    return literal, run_package(parameters, case)


def run_package(parameters: Parameters, case: Case) -> Motion:
    """Run a case by the package's drive."""
    rest_v = max(-case.voltage_v, 0.0)
    parameters = parameters.updated({'amplifier.voltage_initial': rest_v})
    plants = plant_of(parameters)
    states = state_at_rest(plants, parameters.stand.preload)
    if parameters.stand.preload_end:
        change_preload(plants, states, parameters, parameters.stand.preload_end)
    start_clock(states)
    frequency_hz = np.copysign(1.0 / PERIOD_S, case.voltage_v)
    wave = sawtooth(0.0, abs(case.voltage_v), float(frequency_hz), CYCLES + 1)
    ramps = advance_cycles(plants, states, wave, CYCLES, case.load_n)
    _, lost_j = energies_of_contacts(plants, states)
    return Motion(ramps[:, RAMP_MEAN], ramps[:, RAMP_END], float(lost_j))


@measures(
    ('{}: mean position in each cycle', LITERAL, 'm', DRIVE_ERROR, LARGEST),
    ('{}: position after each cycle', LITERAL, 'm', DRIVE_ERROR, LARGEST),
    ('{}: friction loss', LITERAL, 'J', DRIVE_ERROR),
    each=CASES,
)
def _cases(case: Case) -> Measured:
    literal, ours = both_motions(case)
    return (
        (literal.means_m, ours.means_m, float(np.abs(literal.means_m).max())),
        (literal.ends_m, ours.ends_m, float(np.abs(literal.ends_m).max())),
        (literal.lost_j, ours.lost_j),
    )


def _panel() -> Panel:
    numbers, curves = np.arange(1, CYCLES + 1, dtype=float), []
    for colour, case in enumerate(CASES[k] for k in (0, 3, 18)):
        literal, ours = both_motions(case)
        curves += [
            Curve(f'{case}, package', numbers, ours.means_m * NM, 'line', colour),
            Curve(f'{case}, springs', numbers, literal.means_m * NM, 'points', colour),
        ]
    return Panel('Drive from rest, 0.5 N, 130 nm, 1 kHz', 'cycle', 'mean position x (nm)', curves)


DRIVE = Family('Drive', (_cases,), (_panel,))
