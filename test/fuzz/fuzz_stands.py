# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Stands with real-valued parameters that no person would type, each stage of hardware alone."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from stickslip_ros.parameters import Parameters, Scalar, load_values

CONFIG = Path(__file__).parents[2] / 'config'
Draw = Callable[[np.random.Generator], Mapping[str, Any]]

SPANS: Mapping[str, tuple[float, float]] = {
    'actuator.capacitance': (1e-10, 1e-7),
    'actuator.creep': (1e-4, 0.2),
    'actuator.damping_ratio': (1e-3, 3.0),
    'actuator.gain': (1e-10, 2e-9),
    'actuator.gain_tolerance': (1e-4, 0.5),
    'actuator.hysteresis': (1e-3, 0.4),
    'actuator.mass': (1e-6, 1e-3),
    'actuator.resonance': (1e3, 1e6),
    'actuator.stiffness': (1e6, 1e9),
    'amplifier.bandwidth': (1e2, 1e7),
    'amplifier.current_max': (1e-4, 10.0),
    'amplifier.resolution': (1e-8, 10.0),
    'amplifier.slew_rate': (1e5, 1e10),
    'closed_loop.gain': (1.0, 500.0),
    'contact.friction': (0.01, 1.0),
    'contact.hurst': (0.3, 0.95),
    'contact.radius': (1e-5, 1e-2),
    'contact.travel': (0.01, 1.0),
    'contact.young_sphere': (1e9, 1e12),
    'frame.mass': (1e-3, 10.0),
    'interferometer.bandwidth': (1.0, 1e7),
    'interferometer.cyclic_error': (1e-11, 1e-8),
    'interferometer.drift': (1e-12, 1e-6),
    'interferometer.latency': (1e-7, 0.05),
    'interferometer.noise_density': (1e-14, 1e-9),
    'interferometer.random_walk': (1e-12, 1e-6),
    'interferometer.resolution': (1e-13, 1e-7),
    'interferometer.sample_rate': (1e2, 1e6),
    'interferometer.velocity_max': (1e-6, 1.0),
    'interferometer.wavelength': (2e-7, 2e-6),
    'load_cell.bandwidth': (1.0, 1e6),
    'load_cell.damping_ratio': (1e-3, 3.0),
    'load_cell.drift': (1e-9, 1e-2),
    'load_cell.gap': (1e-9, 1e-4),
    'load_cell.hysteresis': (1e-4, 0.4),
    'load_cell.noise_density': (1e-9, 1e-3),
    'load_cell.range': (1e-3, 10.0),
    'load_cell.resolution': (1e-9, 1e-2),
    'load_cell.resonance': (1.0, 1e5),
    'load_cell.restitution': (0.0625, 1.0),
    'load_cell.stiffness': (1e3, 1e7),
    'runner.damping': (1e-3, 300.0),
    'runner.mass': (1e-4, 0.1),
    'sim.dt': (5e-7, 2e-5),
    'stand.preload': (0.01, 2.0),
    'stand.preload_rate': (0.1, 1e3),
    'stand.stop_stiffness': (1e3, 1e8),
}
"""Parameters that are drawn alone, from lowest to highest value, evenly in the logarithm."""
CHOICES: Mapping[str, tuple[Scalar, ...]] = {
    'actuator.plays': (1, 3, 17, 64),
    'interferometer.reference': ('table', 'frame'),
    'contact.law': ('mdr', 'coulomb', 'dahl', 'lugre', 'epm'),
    'contact.profile': ('rough', 'smooth', 'rough_line'),
    'load_cell.contact': ('attached', 'one_sided', 'absent'),
    'sim.block': (1e-4, 2e-3, 0.01),
    'trace.sample_rate': (1e4, 2e5),
}
"""Parameters of which each value is a stand of its own."""
COMPANIONS: Mapping[str, Mapping[str, Scalar]] = {
    'actuator.capacitance': {'amplifier.current_max': 0.3},
    'actuator.damping_ratio': {'actuator.resonance': 153_846.15},
    'actuator.mass': {'frame.mass': 0.0123, 'frame.resonance': 5432.1},
    'actuator.plays': {'actuator.hysteresis': 0.123},
    'actuator.stiffness': {'actuator.resonance': 153_846.15},
    'contact.profile': {'contact.line_points': 2048, 'contact.cutoff_upper': 1e6},
    'contact.travel': {
        'contact.profile': 'rough_line',
        'contact.line_points': 2048,
        'contact.cutoff_upper': 1e6,
    },
    'interferometer.reference': {'frame.mass': 0.0123, 'frame.resonance': 5432.1},
    'interferometer.wavelength': {'interferometer.cyclic_error': 1.7e-9},
    'frame.mass': {'frame.resonance': 5432.1, 'actuator.mass': 1.23e-4},
    'load_cell.damping_ratio': {'load_cell.resonance': 1234.5},
    'load_cell.restitution': {'load_cell.resonance': 1234.5, 'load_cell.contact': 'one_sided'},
    'load_cell.gap': {'load_cell.contact': 'one_sided'},
    'load_cell.hysteresis': {'load_cell.range': 1.93},
    'stand.stop_stiffness': {'stand.travel_min': -1.1e-7, 'stand.travel_max': 2.3e-7},
}
"""What must be set for a parameter to matter."""
LAW_SPANS: Mapping[str, tuple[float, float]] = {
    'friction_law.bristle_damping': (1e-3, 30.0),
    'friction_law.viscous': (1e-3, 30.0),
    'friction_law.static_ratio': (1.01, 2.0),
    'friction_law.stribeck_velocity': (1e-5, 1e-1),
    'friction_law.breakaway_ratio': (0.1, 0.99),
}
"""Parameters of the laws that rival the contact model; drawn with every law."""


def drawn(rng: np.random.Generator, span: tuple[float, float]) -> float:
    """Draw a number from a span, evenly in the logarithm."""
    return float(np.exp(rng.uniform(*np.log(span))))


def _alone(name: str) -> Draw:
    companions = COMPANIONS.get(name, {})
    return lambda rng: {**companions, name: drawn(rng, SPANS[name])}


def _chosen(name: str, value: Scalar) -> Draw:
    def draw(rng: np.random.Generator) -> Mapping[str, Scalar]:
        laws = LAW_SPANS if name == 'contact.law' else {}
        others = {law: drawn(rng, span) for law, span in laws.items()}
        return {**COMPANIONS.get(name, {}), **others, name: value}

    return draw


def _layout(rng: np.random.Generator) -> Mapping[str, Any]:
    """Draw groups of feet that push, oppose or guide, and may be late."""
    groups = int(rng.integers(1, 5))
    counts = rng.integers(1, 4, groups)
    gains = rng.choice((1.0, 0.0, -1.0), groups) * rng.uniform(0.1, 2.0, groups)
    return {
        'feet.count': tuple(map(int, counts)),
        'feet.share': tuple(drawn(rng, (0.01, 2.0)) for _ in counts),
        'feet.radius': tuple(drawn(rng, (1e-4, 2e-3)) for _ in counts),
        'feet.gain': tuple(map(float, gains)),
        'feet.delay': tuple(drawn(rng, (1e-6, 5e-3)) * float(rng.integers(2)) for _ in counts),
        'stand.load': float(rng.uniform(-0.2, 0.2)),
    }


def _walker(rng: np.random.Generator) -> Mapping[str, Any]:
    """Draw equal feet that fall one after another, behind a low-pass or on stacks."""
    groups = int(rng.integers(2, 7))
    stage = rng.choice(('amplifier.bandwidth', 'actuator.stiffness'))
    return {
        'feet.count': (12 // groups,) * groups,
        'feet.share': drawn(rng, (0.1, 1.0)),
        'feet.delay': tuple(np.arange(groups) * drawn(rng, (1e-5, 8e-3))),
        'actuator.hysteresis': 0.123,
        'actuator.creep': 0.02,
        'actuator.resonance': 153_846.15,
        **_alone(str(stage))(rng),
    }


def _several(rng: np.random.Generator) -> Mapping[str, Scalar]:
    """Draw three stages at once."""
    values: dict[str, Scalar] = {}
    for name in rng.choice(sorted(SPANS), 3, replace=False):
        values |= _alone(str(name))(rng)
    if 'actuator.resonance' in values:
        values.pop('actuator.mass', None)  # which stiffness and resonance say
    return values


STANDS: Mapping[str, Draw] = {
    'default': lambda _: {},
    'coupled': lambda _: {},
    'realistic': lambda _: {},
    'bipolar': lambda rng: {
        'amplifier.voltage_min': -drawn(rng, (1.0, 300.0)),
        'amplifier.voltage_max': drawn(rng, (1.0, 300.0)),
    },
    'several': _several,
    'layout': _layout,
    'walker': _walker,
    **{name: _alone(name) for name in SPANS},
    **{
        f'{name}={value}': _chosen(name, value)
        for name, values in CHOICES.items()
        for value in values
    },
}
"""Every stand by its name."""


def stand_of(name: str, rng: np.random.Generator) -> Parameters:
    """Draw the parameters of a stand."""
    files = {'realistic': ('realistic',), 'coupled': ('realistic', 'coupled')}.get(name, ())
    base = Parameters()
    for file in files:
        base = base.updated(load_values(CONFIG / f'{file}.yaml'))
    values: dict[str, Any] = dict(STANDS[name](rng))
    return base.updated({**values, 'sim.seed': int(rng.integers(2**31))})
