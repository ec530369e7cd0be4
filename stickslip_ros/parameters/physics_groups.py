# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Parameters of the physics: contacts, stand, frame, runner, amplifier and piezo; SI."""

import math
from dataclasses import dataclass
from typing import NamedTuple

from stickslip_ros.errors import OutOfRange
from stickslip_ros.parameters.declaration import (
    TABLE_1,
    Checked,
    ReplaceableDefault,
    choice,
    count,
    opposing,
    quantity,
    switch,
)
from stickslip_ros.units import GIGA

LAWS = ('mdr', 'coulomb', 'dahl', 'lugre', 'epm')
"""The contact model and the rival laws; `contact.laws` numbers them in this order."""

FEET_MAX = 12
"""Most feet of a drive."""

PAPER_RMS_HEIGHT = 1.1221e-6
PAPER_PREFACTOR = 4.4478e-4

# A parameter is a row: default, unit, description, bounds, source; the rest by name.
# fmt: off


@dataclass(frozen=True)
class ContactParameters(Checked):
    """One ruby hemisphere on the runner."""

    profile: str = choice(
        'rough', ('rough', 'smooth', 'rough_line'),
        'equivalent rough profile, the bare sphere, or a random rough line (Eq. 14)', 'Eq. 18')
    law: str = choice(
        'mdr', LAWS, 'contact model of the paper, or a rival friction law', 'Section 3')
    radius: float = quantity(
        0.5e-3, 'm', 'radius R of a hemisphere', (1e-6, 1.0), TABLE_1,
        cause='another sphere, or a worn one', assumed=0.1)
    hurst: float = quantity(0.7, '', 'Hurst exponent H of the roughness', (0.01, 1.0), 'Section 4')
    rms_height: float = quantity(
        PAPER_RMS_HEIGHT, 'm', 'rms roughness h; used by a rough line, and where prefactor is 0',
        (0.0, 1e-3), 'Section 4', from_zero=True)
    prefactor: float = quantity(
        PAPER_PREFACTOR, 'm^(1-H)', 'Q_1D of Eq. 17; 0: computed from rms_height', (0.0, 1.0),
        'Section 4', from_zero=True, cause='wear, or another surface')
    line_length: float = quantity(
        1e-3, 'm', 'rough line: length; default: 2 R, the system length of Eq. 16', (1e-6, 1.0))
    line_points: int = count(1 << 17, 'rough line: number of springs along it', (16, 1 << 21))
    cutoff_lower: float = quantity(
        2.0 * math.pi / 1e-3, 'rad/m',
        'rough line: lowest wave number; default: one wave in line_length', (1e-2, 1e10))
    cutoff_upper: float = quantity(
        1e8, 'rad/m',
        'rough line: highest wave number; default: waves of 63 nm, eight springs long',
        (1e-2, 1e10))
    line_seed: int = count(
        1, 'rough line: seed of the first foot; each further foot adds 1', (0, 2**31 - 1))
    travel: float = quantity(
        0.0, '', 'rough line: share of the mean square roughness on the runner, travelling with '
        'it; the surfaces of the paper suggest 1', (0.0, 1.0))
    friction: float = quantity(
        0.3, '', 'friction coefficient mu', (1e-3, 10.0), TABLE_1,
        cause='dirt, moisture or wear; a constant load, as of a tilted rail, has the same effect',
        live=True)
    friction_rate: float = quantity(
        0.0, '', 'a: growth of friction per e-fold of the sliding velocity', (0.0, 0.1),
        typical=0.01)
    friction_ageing: float = quantity(
        0.0, '', 'b: growth of friction per e-fold of the time at rest', (0.0, 0.1), typical=0.01)
    friction_distance: float = quantity(
        1e-6, 'm', 'slip D_c that renews an aged contact', (1e-10, 1e-3))
    friction_velocity: float = quantity(
        1e-3, 'm/s', 'velocity v0 of steady sliding with contact.friction', (1e-9, 10.0))
    friction_cutoff: float = quantity(
        1e-4, 'm/s',
        'velocity v_c below which friction_rate has no effect; a lower v_c shortens the time step',
        (1e-7, 1.0))
    rest_time: float = quantity(
        1.0, 's', 'time at rest before the start; for friction_ageing', (1e-6, 1e9))
    young_runner: float = quantity(
        210 * GIGA, 'Pa', "Young's modulus E1 of the runner, steel X90CrMoV18", (1e3, 1e13),
        TABLE_1, assumed=0.1)
    young_sphere: float = quantity(
        370 * GIGA, 'Pa', "Young's modulus E2 of a hemisphere, ruby", (1e3, 1e13), TABLE_1,
        assumed=0.1)
    poisson_runner: float = quantity(0.3, '', "Poisson's ratio of the runner", (0.0, 0.5), TABLE_1)
    poisson_sphere: float = quantity(
        0.3, '', "Poisson's ratio of a hemisphere", (0.0, 0.5), TABLE_1)
    loss_factor: float = quantity(
        0.0, '', 'loss factor of sticking contacts; a stuck runner rings down with half of it as '
        'damping ratio; about 0.1 measured elsewhere', (0.0, 1.0), typical=0.1, from_zero=True,
        substitute='runner.damping')

    def check_together(self) -> None:
        """Refuse roughness, ageing or loss without effect, and a friction that is not positive."""
        for name in ('friction_rate', 'friction_ageing', 'loss_factor'):
            if getattr(self, name) and self.law != 'mdr':
                limit, hint = f'without effect under contact.law {self.law}', 'set it to 0'
                raise OutOfRange(f'contact.{name}', getattr(self, name), '', limit, hint)
        v0, v_c = self.friction_velocity, self.friction_cutoff
        static = self.friction - self.friction_rate * math.log((v0 + v_c) / v_c)
        static += self.friction_ageing * math.log(v0 * self.rest_time / self.friction_distance)
        if static <= 0.0:
            limit = f'reduced to {static:g}, not above 0, by friction_rate and friction_ageing'
            hint = 'raise it or lower contact.friction_rate or contact.friction_ageing'
            raise OutOfRange('contact.friction', self.friction, '', limit, hint)
        changes = self.friction_rate or self.friction_ageing
        if self.travel and (changes or (self.profile, self.law) != ('rough_line', 'mdr')):
            limit = 'used only on a rough line of constant friction under the law mdr'
            hint = "set contact.profile to 'rough_line', and law, friction_rate and "
            hint += 'friction_ageing to their defaults'
            raise OutOfRange('contact.travel', self.travel, '', limit, hint)
        if self.profile == 'rough_line':
            if self.prefactor not in {0.0, PAPER_PREFACTOR}:
                limit = 'without effect on a rough line, which is made from contact.rms_height'
                hint = 'leave it out, and set contact.rms_height'
                raise OutOfRange('contact.prefactor', self.prefactor, 'm^(1-H)', limit, hint)
        elif self.prefactor and self.rms_height != PAPER_RMS_HEIGHT:
            limit = f'without effect while contact.prefactor is {self.prefactor:g} m^(1-H)'
            raise OutOfRange(
                'contact.rms_height', self.rms_height, 'm', limit, 'set contact.prefactor to 0 too'
            )


@dataclass(frozen=True)
class FrictionLawParameters(Checked):
    """Constants of the rival friction laws."""

    bristle_stiffness: float = quantity(
        0.0, 'N/m', 'sigma0; 0: the full-stick stiffness of all contacts', (0.0, 1e12))
    bristle_damping: float = opposing(
        0.0, 'N s/m', 'sigma1 of LuGre and EPM', (0.0, 1e6), from_zero=True)
    viscous: float = opposing(0.0, 'N s/m', 'sigma2, viscous friction', (0.0, 1e6), from_zero=True)
    static_ratio: float = quantity(
        1.0, '', 'ratio Fs/Fc of static to Coulomb friction; Fc is mu F_n', (1.0, 10.0))
    stribeck_velocity: float = quantity(1e-3, 'm/s', 'Stribeck velocity vs', (1e-9, 10.0))
    breakaway_ratio: float = quantity(
        0.7, '', 'z_ba/z_ss of EPM: bristles deflected less are elastic', (0.0, 0.99))


@dataclass(frozen=True)
class StandParameters(Checked):
    """The frame that holds the feet."""

    preload: float = quantity(
        ReplaceableDefault(0.5), 'N',
        'preload F_p of the external spring; 0.1 to 1 N in the paper', (1e-3, 100.0), 'Section 2',
        assumed=0.05)
    preload_end: float = quantity(
        0.0, 'N', 'end of a preload ramp that begins at the start; 0: no ramp', (0.0, 100.0))
    preload_rate: float = quantity(1.0, 'N/s', 'rate of change of the preload', (1e-6, 1e6))
    weight: bool = switch(
        False, 'add the weight of the runner to the contacts (feet.weight); the paper neglects it')
    preload_limit: float = quantity(
        2.0, 'N', 'largest preload that a command may ask for', (1e-3, 100.0))
    load: float = opposing(
        0.0, 'N',
        'constant external force on the runner, plus that of a command: the weight of a z axis',
        (-1000.0, 1000.0))
    load_limit: float = quantity(
        10.0, 'N', 'largest external force that a command may ask for', (0.0, 1000.0))
    travel_min: float = quantity(-5e-3, 'm', 'position of the lower end stop', (-1.0, -1e-7))
    travel_max: float = quantity(5e-3, 'm', 'position of the upper end stop', (1e-7, 1.0))
    stop_stiffness: float = opposing(
        0.0, 'N/m', 'stiffness of the end stops; 0: no end stops', (0.0, 1e9))


class FootGroup(NamedTuple):
    """Equal feet: number, normal force of one per preload and per weight, and their motion."""

    feet: int
    share: float
    weight: float
    radius_m: float  # 0: contact.radius
    # 0: contact.friction and contact.young_sphere
    friction: float
    young_pa: float
    gain: float
    delay_s: float
    friction_n: float = 0.0  # friction limit in addition to that of preload and weight


_FOR_ALL = {'gain': 1.0, **dict.fromkeys(('weight', 'radius', 'friction', 'young', 'delay'), 0.0)}
"""Values of all groups where no values are given and feet.count has another length than here."""


@dataclass(frozen=True)
class FeetParameters(Checked):
    """
    The feet, in groups of equal ones: an element of each array for each group.

    An array of one element holds for all groups. A dry guide is a group of its own, the last.

    """

    count: tuple[int, ...] = count(
        (2, 4), 'feet in each group, 12 at most together', (1, FEET_MAX), 'Section 2')
    share: tuple[float, ...] = quantity(
        (math.sqrt(2.0) / 2.0, math.sqrt(2.0) / 4.0), '', 'normal force of one foot per preload',
        (1e-6, 100.0), 'Eq. 19')
    weight: tuple[float, ...] = quantity(
        (0.0, math.sqrt(2.0) / 4.0), '',
        'normal force of one foot per weight of the runner, where stand.weight is on',
        (0.0, 100.0), 'Eq. 19')
    radius: tuple[float, ...] = quantity(
        (0.0, 0.0), 'm', 'radius of a foot; 0: contact.radius', (0.0, 1.0), TABLE_1, least=1e-6)
    friction: tuple[float, ...] = quantity(
        (0.0, 0.0), '', 'friction coefficient of a foot, to which friction_rate and '
        'friction_ageing are proportional; 0: contact.friction', (0.0, 10.0), least=1e-4)
    young: tuple[float, ...] = quantity(
        (0.0, 0.0), 'Pa', "Young's modulus of a foot; 0: contact.young_sphere", (0.0, 1e13),
        least=1e3)
    gain: tuple[float, ...] = quantity(
        (1.0, 1.0), '',
        'displacement relative to actuator.gain; 0: a guide at rest; below 0: against the others',
        (-10.0, 10.0))
    delay: tuple[float, ...] = quantity(
        (0.0, 0.0), 's', "delay of the group's voltage, for feet that fall one after another",
        (0.0, 0.05), least=1e-6)
    guide_friction: float = opposing(
        0.0, 'N',
        'dry friction of a guide at rest, an extra contact, at any preload; 0: none',
        (0.0, 100.0), typical=0.005, from_zero=True, cause='dirt or wear in the guide')

    def check_together(self) -> None:
        """Give each group a value of each array; refuse another number of values, or of feet."""
        groups = len(self.count)
        for name, field in self.__dataclass_fields__.items():
            values = getattr(self, name)
            if not isinstance(values, tuple):
                continue
            is_default = values == field.default and name in _FOR_ALL
            if groups != len(values) and is_default:
                values = (_FOR_ALL[name],)
            if len(values) not in (1, groups):
                limit = f'of length {len(values)}, but feet.count is of length {groups}'
                hint = 'give a value for each group, or one for all'
                raise OutOfRange(f'feet.{name}', list(values), '', limit, hint)
            self.__dict__[name] = values * (groups if len(values) == 1 else 1)
        if self.total > FEET_MAX:
            limit = f'above {FEET_MAX} feet together'
            limit += ', with one for feet.guide_friction' * bool(self.guide_friction)
            raise OutOfRange('feet.count', list(self.count), '', limit, 'lower it')

    def check_foot(self, name: str, foot: int) -> None:
        """Refuse the number of a foot, from 1, that does not exist."""
        if foot > self.total:
            limit = f'above the number of feet, {self.total}'
            raise OutOfRange(name, foot, '', limit, 'lower it')

    @property
    def groups(self) -> tuple[FootGroup, ...]:
        names = [name for name in self.__dataclass_fields__ if name != 'guide_friction']
        rows = zip(*(getattr(self, name) for name in names), strict=True)
        guide = FootGroup(1, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, self.guide_friction)
        return (*(FootGroup(*row) for row in rows), *[guide] * bool(self.guide_friction))

    @property
    def total(self) -> int:
        return sum(self.count) + bool(self.guide_friction)


@dataclass(frozen=True)
class FrameParameters(Checked):
    """The frame as a mass on a spring; it carries the feet only, the table all other parts."""

    mass: float = opposing(
        0.0, 'kg', 'mass of the frame with its feet; 0: rigid frame', (0.0, 1e3),
        least=1e-4)  # a thirtieth of the runner; lighter frames only follow the contacts
    resonance: float = quantity(
        0.0, 'Hz', 'resonance of the frame on the table; 0: free frame', (0.0, 1e6))
    damping_ratio: float = quantity(0.01, '', 'damping ratio of that resonance', (0.0, 10.0))


@dataclass(frozen=True)
class RunnerParameters(Checked):
    """The moving body."""

    mass: float = opposing(
        3e-3, 'kg', 'mass m of the runner', (1e-6, 10.0), TABLE_1,
        cause='something was put on the runner, or taken off', resumable=True, live=True)
    damping: float = opposing(
        0.0, 'N s/m', 'viscous damping c of the runner; the paper gives none', (0.0, 1e4),
        typical=20.0, from_zero=True, cause='something touches the runner', resumable=True,
        live=True)


@dataclass(frozen=True)
class AmplifierParameters(Checked):
    """The high-voltage amplifier between a command and the piezo."""

    voltage_min: float = quantity(0.0, 'V', 'lowest output', (-1e3, 999.0), 'Section 2')
    voltage_max: float = quantity(300.0, 'V', 'highest output', (-999.0, 1e3), 'Section 2')
    voltage_initial: float = quantity(
        ReplaceableDefault(0.0), 'V', 'output at the start, with relaxed contacts', (-1e3, 1e3))
    slew_rate: float = quantity(
        150e6, 'V/s', 'fastest change of the output', (1e3, 1e12), 'Section 2',
        cause='the amplifier, or another capacitance behind it', resumable=True)
    frequency_max: float = quantity(
        20e3, 'Hz', 'highest saw-tooth frequency that a command may ask for', (1.0, 1e6))
    bandwidth: float = quantity(
        0.0, 'Hz', 'first-order low-pass of the output; 0: none', (0.0, 1e9), typical=2e5,
        least=1.0)
    resolution: float = quantity(
        0.0, 'V', 'step of the digital-to-analogue converter; 0: none', (0.0, 10.0))
    current_max: float = quantity(
        0.0, 'A',
        'largest current into actuator.capacitance, a limit of the slew rate; 0: no limit',
        (0.0, 1e3))

    @property
    def range_v(self) -> float:
        """Largest amplitude that the amplifier gives, V."""
        return self.voltage_max - self.voltage_min

    def check_together(self) -> None:
        """Refuse an empty voltage range, and a start outside it."""
        if self.voltage_min >= self.voltage_max:
            limit = f'not below amplifier.voltage_max, {self.voltage_max:g} V'
            hint = 'lower it or raise amplifier.voltage_max'
            raise OutOfRange('amplifier.voltage_min', self.voltage_min, 'V', limit, hint)
        if not self.voltage_min <= self.voltage_initial <= self.voltage_max:
            limit = f'outside {self.voltage_min:g} to {self.voltage_max:g} V'
            hint = 'move it between amplifier.voltage_min and amplifier.voltage_max'
            raise OutOfRange('amplifier.voltage_initial', self.voltage_initial, 'V', limit, hint)


@dataclass(frozen=True)
class ActuatorParameters(Checked):
    """The piezo with its hemisphere."""

    gain: float = quantity(
        160e-9 / 300.0, 'm/V', 'foot displacement per volt: 160 nm at 300 V', (1e-13, 1e-6),
        'Section 2',
        below='raise it; if the piezo moves against its voltage, set feet.gain below 0',
        cause='the piezo or its amplifier, of all feet or of one')
    capacitance: float = quantity(
        5e-09, 'F', 'capacitance of all piezos together, charged by the amplifier', (1e-12, 0.001))
    hysteresis: float = quantity(
        0.0, '', 'width of the loop over the whole voltage range, at mid-range, as a share of '
        'the stroke; 0: none', (0.0, 0.4), typical=0.05, from_zero=True)
    plays: int = count(8, 'number of play operators of the hysteresis', (1, 64))
    creep: float = quantity(
        0.0, '', 'relative growth of a displacement per decade of time; 0: none', (0.0, 0.2),
        typical=0.01, from_zero=True)
    resonance: float = quantity(
        0.0, 'Hz',
        'resonance of the piezo with its hemisphere, without load; 0: it follows at once',
        (0.0, 1e7), typical=2e5, least=1.0)
    damping_ratio: float = quantity(
        0.05, '', 'damping ratio of that resonance', (0.001, 10.0), typical=0.05)
    stiffness: float = opposing(
        0.0, 'N/m', 'stiffness of the piezo under a foot: blocking force per stroke; 0: rigid',
        (0.0, 1e12), least=1e5)  # a twentieth of its contact: it gets 5 % of the motion
    mass: float = opposing(
        0.0, 'kg',
        'mass of a foot, for the recoil of the frame; 0 if resonance and stiffness give it',
        (0.0, 1.0))
    gain_tolerance: float = quantity(
        0.0, '', "largest relative deviation of a foot's gain from the mean; 0: none", (0.0, 0.9),
        typical=0.01)

    def check_together(self) -> None:
        """Refuse a stiffness without a mass, and a mass given twice."""
        if self.stiffness and not self.resonance:
            limit = 'without a mass while actuator.resonance is 0 Hz'
            hint = 'set actuator.resonance too'
            raise OutOfRange('actuator.stiffness', self.stiffness, 'N/m', limit, hint)
        if self.mass and self.resonance:
            limit = f'without effect while actuator.resonance is {self.resonance:g} Hz'
            stiffness = self.mass * (2.0 * math.pi * self.resonance) ** 2
            hint = f'set it to 0, and actuator.stiffness to {stiffness:.4g} N/m'
            raise OutOfRange('actuator.mass', self.mass, 'kg', limit, hint)

    @property
    def foot_mass(self) -> float:
        """Mass of a foot, kg: the hemisphere and the moving part of its piezo."""
        if not self.stiffness:
            return self.mass
        return self.stiffness / (2.0 * math.pi * self.resonance) ** 2
