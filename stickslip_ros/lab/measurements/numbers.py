# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Measured numbers of a drive: a row each, with its column and its prediction."""

import math
import re
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

from stickslip_ros.drive.build import friction_limit_n, slew_of
from stickslip_ros.drive.layout import contacts_of
from stickslip_ros.errors import OutOfRange
from stickslip_ros.parameters import Parameters

SHEET_SHARE = 0.2
"""Relative standard error of a data sheet's number without a tolerance."""
SIGMA = '_sigma_'
BACK = {'step_length_m': 'step_back_m', 'speed_m_per_s': 'speed_back_m_per_s'}
"""Numbers forwards, and their names backwards."""


def sigma_name(name: str) -> str:
    """Return the column of an uncertainty: ``force_sigma_n`` for ``force_n``."""
    return re.sub('_((?:[mv]_per_)?[^_]+)$', rf'{SIGMA}\1', name)


class MeasuredNumber(NamedTuple):
    """A measured number: its usual headers, and the prediction of a stand."""

    words: str  # headers in lower case, separated by commas; empty: not in laboratory tables
    drive: str  # steps, zero, ring, loop, or rest
    # prediction from the result of the drive and the stand; None: the result's field of that name
    shown: Callable[[Any, Parameters], float] | None = None
    runner: str = 'free'  # free, held by a load cell; empty: held if forces were measured
    is_of_sheet: bool = False  # above 0; default error SHEET_SHARE

    @property
    def settings(self) -> tuple[str, ...]:
        """Columns needed; a blocking force without a stroke is at the full range."""
        if self.drive == 'loop':
            return 'displacement_m', 'normal_n'
        is_full = self.drive in {'zero', 'rest'} or self.runner == 'held'
        strokes = () if is_full else ('amplitude_m', 'amplitude_sigma_m', 'voltage_v', 'direction')
        return ('preload_n', *strokes, *([] if self.drive == 'rest' else ['frequency_hz']))


def _speed_m_per_s(run: Any, _: Parameters) -> float:
    return float(run.step_length_m * abs(run.frequency_hz))


def stage_hz(stand: Parameters) -> float:
    """Return the frequency of a free runner on its sticking contacts, Hz."""
    if stand.contact.law != 'mdr':
        limit, hint = 'a law without one stiffness for all small motions', "set it to 'mdr'"
        raise OutOfRange('contact.law', stand.contact.law, '', limit, hint)
    stiffness = sum(each.stick_stiffness_n_per_m for each in contacts_of(stand))
    return math.sqrt(stiffness / stand.runner.mass) / (2.0 * math.pi)


# fmt: off
_ROWS: Mapping[str, tuple[Any, ...]] = {
    'force_n': ('force, f, load, load cell, generated force, kraft', 'steps',
                lambda run, _: run.force_mean_n, ''),
    'step_length_m': ('step length, step size, step, schrittlänge, schrittweite', 'steps'),
    'zero_amplitude_m': ('zero amplitude, 0 amplitude, nullamplitude', 'zero'),
    'ringing_hz': ('ringing, ringing frequency, ring down frequency, ausschwingfrequenz', 'ring',
                   None, ''),
    'decay_s': ('decay, decay time, ring down time, abklingzeit', 'ring', None, ''),
    'step_back_m': ('step length back', 'steps', lambda run, _: -run.step_length_m),
    'speed_m_per_s': ('speed, velocity, geschwindigkeit', 'steps', _speed_m_per_s),
    'speed_back_m_per_s': ('speed back', 'steps', lambda *run: -_speed_m_per_s(*run)),
    'onset_v': ('onset, onset voltage, threshold voltage', 'zero',
                lambda found, on: found.zero_amplitude_m / on.actuator.gain, 'free', True),
    'blocking_force_n': ('blocking force, blocked force, stall force, push force', 'steps',
                         lambda run, _: run.force_ramp_start_n, 'held', True),
    'holding_force_n': ('holding force, haltekraft', 'rest',
                        lambda _, on: friction_limit_n(on), 'free', True),
    'moving_mass_kg': ('moving mass, mass, runner mass', 'rest',
                       lambda _, on: on.runner.mass, 'free', True),
    'stage_frequency_hz': ('stage frequency, resonance frequency, resonant frequency', 'rest',
                           lambda _, on: stage_hz(on), 'free', True),
    'capacitance_f': ('capacitance, kapazität', 'rest',
                      lambda _, on: on.actuator.capacitance, 'free', True),
    'slew_v_per_s': ('slew, slew rate', 'rest', lambda _, on: slew_of(on), 'free', True),
    'tangential_n': ('tangential force, tangential, friction force, tangentialkraft, reibkraft',
                     'loop', None, ''),
    'energy_loss_per_step_j': ('', 'steps', None, ''),
}
# fmt: on
NUMBERS = {name: MeasuredNumber(*row) for name, row in _ROWS.items()}
"""Measured numbers, by column."""
