# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The stuck drive as a linear system: small motions while the runner sticks.

After a reversal the contact stiffness is that of full stick, whatever the history (Masing), and a
small oscillation reverses all the time. So the stiffness depends on preload, not on history.

"""

import re
from dataclasses import dataclass, field
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from stickslip_ros.arrays import Array
from stickslip_ros.drive.advance import advance
from stickslip_ros.drive.build import plant_of, start_clock, state_at_rest
from stickslip_ros.drive.layout import contacts_of, ratios_of
from stickslip_ros.drive.piezo import CREEP_FASTEST_S
from stickslip_ros.drive.records import DECADES
from stickslip_ros.drive.waveform import table
from stickslip_ros.errors import OutOfRange
from stickslip_ros.extras import load_extra
from stickslip_ros.instrument.commands import Request, check_request
from stickslip_ros.kernels.record import Record
from stickslip_ros.lab.figures.plottable import Plottable
from stickslip_ros.lab.linear.sampled import Complex, read
from stickslip_ros.parameters import Parameters, checked_arguments
from stickslip_ros.sections import Section, si_row
from stickslip_ros.units import MICRO

if TYPE_CHECKING:
    from matplotlib.figure import Figure


INPUTS = ('voltage_v', 'load_n')
OUTPUTS = ('position_m', 'foot_m')
SETTLING_S = 0.02  # time to approach a position without ringing, and to rest
SETTLING_ROWS = 1000
LEAD_RAD = 0.1  # largest lead, from rounding and creep; other phases lag


class Response(NamedTuple):
    """Complex frequency responses, each of shape (n,)."""

    position_m_per_v: Complex  # from the commanded voltage and from the load to the runner
    position_m_per_n: Complex


@dataclass(frozen=True, eq=False, repr=False)
class LinearDrive(Plottable):
    """
    State space of the stuck drive: x' = A x + B u, y = C x + D u, all in SI units.

    Inputs are voltage (V) and load (N), outputs the positions of the runner and of the mean foot
    (m), all as differences from their rest.

    """

    A: Array  #: shape (n, n)
    B: Array  #: shape (n, 2)
    C: Array  #: shape (2, n)
    D: Array  #: shape (2, 2)
    states: tuple[str, ...]  #: names of the n states, with units
    at_voltage_v: float  #: operating point
    at_position_m: float
    contact_n_per_m: float  #: stiffness of the contacts together
    cell_n_per_m: float  #: stiffness of touched load cell and end stops
    resonance_hz: float  #: natural frequency of the runner
    parameters: Parameters = field(repr=False)  #: the stand

    @checked_arguments
    def response(self, frequency_hz: ArrayLike) -> Response:
        """Return the response of the runner at frequencies, Hz."""
        matrix = self.matrix(frequency_hz)
        return Response(matrix[:, 0, 0], matrix[:, 0, 1])

    def matrix(self, frequency_hz: ArrayLike) -> Complex:
        """Return C (s - A)^-1 B + D at n frequencies, Hz; shape (n, outputs, inputs)."""
        hertz = np.atleast_1d(np.asarray(frequency_hz, float))
        s = 2j * np.pi * hertz[:, None, None]
        moved: Any = np.linalg.solve(s * np.eye(len(self.A)) - self.A, self.B[None])
        matrix: Complex = self.C @ moved + self.D
        return matrix

    def sections(self) -> list[Section]:
        """Return operating point, stiffnesses and resonance."""
        title = f'stuck at {self.at_voltage_v:g} V, preload {self.parameters.stand.preload:g} N'
        rows = [
            si_row('stiffness of the contacts', self.contact_n_per_m, '.4f', 'N/um'),
            si_row('stiffness of load cell and stops', self.cell_n_per_m, '.4f', 'N/um'),
            ('resonance of the runner', f'{self.resonance_hz:.1f}', 'Hz'),
        ]
        return [Section(title, rows, draw=self._draw)]

    def _draw(self) -> 'Figure':
        from stickslip_ros.lab.linear.bode import draw_bode  # noqa: PLC0415 - takes long

        return draw_bode(self.resonance_hz, partial(closed_form, self))

    def __repr__(self) -> str:
        return (
            f'LinearDrive: resonance {self.resonance_hz:.5g} Hz, {len(self.states)} states, '
            f'at {self.at_voltage_v:.4g} V'
        )

    @checked_arguments
    def to_control(self, dt: float | None = None, *, sensors: bool = False) -> Any:
        """
        Return a StateSpace of python-control, in V, N and um, with named signals.

        Write ``drive * controller``: a product has the type of its first factor, and as a
        transfer function the polynomials of this drive overflow to NaN. For margins take
        ``control.frd(loop, omega, smooth=True)``.

        Parameters
        ----------
        dt : float, optional
            Sampling period, s, over which voltage and load are held; continuous time if None.
        sensors : bool
            Output the interferometer's reading (low-pass, own sampling, latency, no noise) in
            place of the true positions.

        Raises
        ------
        MissingExtra
            If python-control is not installed.
        StickSlipError
            If ``sensors`` come without ``dt``, or ``dt`` does not fit the sensor.

        """
        control = load_extra('a system of python-control', 'control')
        per_m = np.array([1.0 if each.endswith('_v') else 1.0 / MICRO for each in self.states])
        names = {
            'inputs': [*INPUTS],
            'outputs': [_in_um(each) for each in OUTPUTS],
            'states': [_in_um(each) for each in self.states],
        }
        system = control.ss(
            self.A * per_m[:, None] / per_m,
            self.B * per_m[:, None],
            self.C / (MICRO * per_m),
            self.D / MICRO,
            **names,
        )
        if dt is None:
            if sensors:
                limit = 'of a sampled system only'
                raise OutOfRange('sensors', sensors, '', limit, 'give dt, as sim.block')
            return system
        if not sensors:
            return system.sample(dt)  # exact at the samples, as the inputs are held
        matrices, names['states'] = read(system, dt, self.parameters)
        return control.ss(*matrices, dt, **{**names, 'outputs': names['outputs'][:1]})


def _in_um(name: str) -> str:
    """Return the name with micrometres in place of metres."""
    return re.sub('_m(?=$|_per_s$)', '_um', name)


def closed_form(linear: LinearDrive, frequency_hz: Array) -> tuple[Complex, Array]:
    """Return response (m/V, m/N) and phase (degrees), shape (n, 2); each lag is below one turn."""
    matrix = linear.matrix(frequency_hz)
    foot, response = matrix[:, 1, 0], matrix[:, 0]
    factors = np.column_stack((response[:, 0] / foot, response[:, 1], foot))
    lags_rad = LEAD_RAD - np.mod(LEAD_RAD - np.angle(factors), 2.0 * np.pi)
    lags_rad[:, 0] += lags_rad[:, 2]
    return response, np.degrees(lags_rad[:, :2])


@checked_arguments
def linearise(parameters: Parameters, at_voltage_v: float | None = None) -> LinearDrive:
    """
    Linearise the drive for motions so small that no contact slips.

    Low-pass, creep, resonance, gains of the feet, frame, damping, touched springs and the linear
    part of the hysteresis are kept. Slew rate, converter and the rest of the hysteresis are
    neglected. Travelling roughness stays at its start.

    Parameters
    ----------
    parameters : Parameters
        The stand, at ``stand.preload``.
    at_voltage_v : float, optional
        Operating voltage, reached from rest; by default the middle of the amplifier's range, V.

    Raises
    ------
    StickSlipError
        If the amplifier cannot give the voltage, or the contacts obey another friction law.

    Examples
    --------
    >>> linearise(Parameters().updated({'stand.preload': 0.25}))
    LinearDrive: resonance 8078.1 Hz, 2 states, at 150 V

    """
    return linear_drive(parameters, *drive_at(parameters, at_voltage_v))


def drive_at(
    parameters: Parameters, at_voltage_v: float | None = None
) -> tuple[float, Record, Record]:
    """Return voltage, plant and state of a drive that has settled at it from rest."""
    if parameters.contact.law != 'mdr':
        limit = 'a law without one stiffness for all small motions'
        raise OutOfRange('contact.law', parameters.contact.law, '', limit, "set it to 'mdr'")
    amplifier, at_v = parameters.amplifier, at_voltage_v
    if at_v is None:
        at_v = 0.5 * (amplifier.voltage_min + amplifier.voltage_max)
    check_request(Request('voltage', (at_v,)), parameters)
    plants = plant_of(parameters)
    if plants[0].delayed:
        limit, hint = 'a delay, which no linear model of finite order has', 'set it to 0 s'
        raise OutOfRange('feet.delay', list(parameters.feet.delay), 's', limit, hint)
    states = state_at_rest(plants, parameters.stand.preload)
    share: Array = np.linspace(0.0, 1.0, SETTLING_ROWS, dtype=np.float64)
    way_v = amplifier.voltage_initial + (at_v - amplifier.voltage_initial) * smooth(share)
    start_clock(states)
    wave = table(np.column_stack((SETTLING_S * share, way_v)))
    advance(plants, states, wave, 0.0, 2.0 * SETTLING_S, np.zeros((1, 3)))
    return at_v, plants, states


def smooth(share: Array) -> Array:
    """Return a rise without corners from 0 (share 0) to 1 (share 1)."""
    return 0.5 - 0.5 * np.cos(np.pi * np.clip(share, 0.0, 1.0))


def linear_drive(
    parameters: Parameters, at_v: float, plants: Record, states: Record
) -> LinearDrive:
    """Linearise the drive at the state of `drive_at`."""
    plant, at_m = plants[0], float(states['position_m'].item())
    walls, button, kg = plant.walls, plant.button, float(plant.mass_kg)
    cell_n_per_m, damping_n_s_per_m = plant.cell_n_per_m, float(plant.damping_n_s_per_m)
    if at_m > walls.gap_m:
        cell_n_per_m += walls.cell_n_per_m
    if button.exists and at_m > button.gap_m:
        cell_n_per_m += button.n_per_m
        kg += float(button.mass_kg)
        damping_n_s_per_m += float(button.damping_n_s_per_m)
    if not walls.low_m < at_m < walls.high_m:
        cell_n_per_m += walls.stop_n_per_m
    contacts_n_per_m = np.array([e.stick_stiffness_n_per_m for e in contacts_of(parameters)])
    of, rates, foot_m, pull_n = rates_of_feet(plant, contacts_n_per_m, ratios_of(parameters))
    # The states of velocities leave out the impulse of the loss in the contacts: no input is
    # differentiated.
    velocity = of['velocity_m_per_s'] - plant.loss_s * pull_n / kg
    held_n = cell_n_per_m * of['position_m'] + damping_n_s_per_m * velocity
    rates['position_m'] = velocity
    rates['velocity_m_per_s'] = (of['load_n'] - pull_n - held_n) / kg
    names = tuple(each for each in of if each in rates)
    kept = [list(of).index(each) for each in (*names, *INPUTS)]
    moves = np.array([rates[each] for each in names])[:, kept]
    seen = np.array([of['position_m'], foot_m])[:, kept]
    n, contact_n_per_m = len(names), float(contacts_n_per_m.sum())
    return LinearDrive(
        *(moves[:, :n], moves[:, n:], seen[:, :n], seen[:, n:]),
        states=names,
        at_voltage_v=at_v,
        at_position_m=at_m,
        contact_n_per_m=contact_n_per_m,
        cell_n_per_m=float(cell_n_per_m),
        resonance_hz=float(np.sqrt((contact_n_per_m + cell_n_per_m) / kg) / (2.0 * np.pi)),
        parameters=parameters,
    )


def rates_of_feet(
    plant: Record, contacts_n_per_m: Array, ratios: Array
) -> tuple[dict[str, Array], dict[str, Array], Array, Array]:
    """
    Return what moves the feet and the frame, as rows over all possible states and the inputs.

    These are the unit rows of states and inputs, the rates of the states of this plant, the mean
    foot relative to the frame (m), and the force of the contacts on the runner (N).

    """
    piezo, frame = plant.piezo, plant.frame
    creep = [f'creep_{k}_m' for k in range(DECADES)]
    driven = np.flatnonzero(ratios)  # the others are guides, without a stack
    bent = [f'foot_{k + 1}_m' for k in driven]
    speeds = [f'{name}_per_s' for name in bent]
    first, last = ('amplifier_v', *creep, 'foot_m', 'foot_m_per_s'), ('centre_m', 'centre_m_per_s')
    columns = [*first, *bent, *speeds, *last, 'position_m', 'velocity_m_per_s', *INPUTS]
    of = dict(zip(columns, np.eye(len(columns)), strict=True))
    rates, foot_m = driven_foot(plant, of, creep)
    bends, omega = piezo.stack_n_per_m > 0.0, piezo.omega_per_s
    sigma = 2.0 * piezo.damping_ratio * omega
    if omega > 0.0 and not bends:
        rates['foot_m'] = of['foot_m_per_s']
        rates['foot_m_per_s'] = omega**2 * (foot_m - of['foot_m']) - sigma * of['foot_m_per_s']
        foot_m = of['foot_m']
    feet_m = np.outer(ratios, foot_m)
    wanted_m = feet_m[driven]
    if bends:
        feet_m[driven] = [of[name] for name in bent]
    mean_m = feet_m[driven].mean(axis=0) if len(driven) else foot_m
    share, recoil, frame_m = frame.feet_share, 0.0 * foot_m, 0.0 * foot_m
    if frame.exists:
        frame_m = of['centre_m'] - share * mean_m
    loads_n = contacts_n_per_m[:, None] * (of['position_m'] - frame_m - feet_m)
    if frame.exists:
        # Velocity of the centre of mass, less the damper's share of the feet.
        gamma = frame.damping_n_s_per_m / frame.mass_kg
        kick = plant.loss_s * loads_n.sum(axis=0) / frame.mass_kg
        rates['centre_m'] = of['centre_m_per_s'] + gamma * share * mean_m + kick
        recoil = (loads_n.sum(axis=0) - frame.held_n_per_m * frame_m) / frame.mass_kg
        rates['centre_m_per_s'] = recoil - gamma * rates['centre_m']
    if bends:
        speed = np.array([of[name] for name in speeds])
        speed += plant.loss_s * loads_n[driven] / piezo.foot_kg
        if frame.exists:
            guides_n = loads_n.sum(axis=0) - loads_n[driven].sum(axis=0)
            speed -= plant.loss_s * guides_n / ((1.0 - share) * frame.mass_kg)
        pulls = omega**2 * (wanted_m - feet_m[driven]) - sigma * speed
        pulls += loads_n[driven] / piezo.foot_kg
        if frame.exists:
            recoil = recoil - gamma * (rates['centre_m'] - share * speed.mean(axis=0))
            recoil = (recoil - share * pulls.mean(axis=0)) / (1.0 - share)
        rates |= dict(zip(bent, speed, strict=True))
        rates |= dict(zip(speeds, pulls - recoil, strict=True))
    return of, rates, mean_m if bends else foot_m, loads_n.sum(axis=0)


def driven_foot(
    plant: Record, of: dict[str, Array], creep: list[str]
) -> tuple[dict[str, Array], Array]:
    """Return the rates of amplifier and creep, and where they drive a foot of gain 1, m."""
    rates, voltage_v = dict[str, Array](), of['voltage_v']
    if plant.amplifier.tau_s > 0.0:
        rates['amplifier_v'] = (voltage_v - of['amplifier_v']) / plant.amplifier.tau_s
        voltage_v = of['amplifier_v']
    static_m = foot_m = plant.gain_m_per_v * plant.piezo.linear * voltage_v
    for k, name in enumerate(creep if plant.piezo.creep > 0.0 else []):
        rates[name] = (static_m - of[name]) / (CREEP_FASTEST_S * 10.0**k)
        foot_m = foot_m + plant.piezo.creep * of[name]
    return rates, foot_m
