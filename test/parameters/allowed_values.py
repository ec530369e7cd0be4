# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Strategy of the parameter tests: any set of values that the declarations allow."""

from hypothesis import strategies as st

from stickslip_ros.parameters import Spec, specs

# These hang together, so they are drawn together below.
COUPLED = {
    'contact.prefactor',
    'contact.rms_height',
    'contact.travel',
    'amplifier.voltage_min',
    'amplifier.voltage_max',
    'amplifier.voltage_initial',
    'sim.block',
    'sim.wake',
    'trace.sample_rate',
    'trace.period',
    'limits.soft_min',
    'limits.soft_max',
    'load_cell.hysteresis',
    'load_cell.range',
    'actuator.resonance',
    'actuator.mass',
    'actuator.stiffness',
    'contact.friction_rate',
    'contact.loss_factor',
    'contact.friction_ageing',
    'fault.dead_foot',
    'stand.weight',
    *(name for name in specs() if name.startswith('feet.')),
}
NAMES = {'sim.joint_name', 'frame_id.stage', 'frame_id.runner', 'frame_id.load_cell'}
"""Texts that are neither empty nor begin with a slash, without #."""
NUMBERS = {
    name: spec
    for name, spec in specs().items()
    if spec.minimum is not None and spec.kind is float and not spec.is_array
}
PERIODS = ((1e-3, 50e3, 0.01), (1e-4, 10e3, 1e-4), (0.1, 1e6, 1.0), (2.5e-4, 20e3, 1e-3))
"""Block, sample rate and trace period that fit into each other."""


TEXTS = st.from_regex(r'[A-Za-z0-9_./~ #:{}\-]{0,30}', fullmatch=True)


def value_of(spec: Spec) -> st.SearchStrategy:
    if spec.choices:
        return st.sampled_from(spec.choices)
    if spec.kind is float:
        zero = st.just(0.0) if spec.least else st.nothing()
        return zero | st.floats(spec.least or spec.minimum, spec.maximum)
    if spec.kind is int:
        return st.integers(int(spec.minimum), int(spec.maximum))
    if spec.kind is bool:
        return st.booleans()
    return TEXTS


@st.composite
def allowed_values(draw: st.DrawFn) -> dict[str, object]:
    """Draw ``{'group.name': value}`` for some parameters, all of it allowed."""
    free = {name: value_of(spec) for name, spec in specs().items() if name not in COUPLED}
    free['actuator.resonance'] = value_of(specs()['actuator.resonance'])
    free |= {name: TEXTS.map(lambda text: f'a{text}'.replace('#', '')) for name in NAMES}
    values = draw(st.fixed_dictionaries({}, optional=free))
    if draw(st.booleans()):
        values['contact.prefactor'] = 0.0
        values['contact.rms_height'] = draw(st.floats(0.0, 1e-3))
    if draw(st.booleans()):
        values |= {'contact.profile': 'rough_line', 'contact.law': 'mdr', 'stand.preload_end': 0.0}
        values |= {'contact.friction_rate': 0.0, 'contact.friction_ageing': 0.0}
        values['contact.travel'] = draw(st.floats(0.0, 1.0))
    if draw(st.booleans()):
        values |= {'actuator.resonance': 0.0, 'actuator.mass': draw(st.floats(0.0, 1.0))}
    elif draw(st.booleans()):
        values['actuator.resonance'] = draw(st.floats(1.0, 1e7))
        values['actuator.stiffness'] = draw(st.floats(1e5, 1e12))
    if draw(st.booleans()):
        counts = draw(st.lists(st.integers(1, 4), min_size=1, max_size=3))
        values['feet.count'] = tuple(counts)
        for name in ('share', 'weight', 'radius', 'friction', 'young', 'gain', 'delay'):
            spec = specs()[f'feet.{name}']
            values[f'feet.{name}'] = draw(st.tuples(*[value_of(spec)] * len(counts)))
        values['stand.weight'] = any(values['feet.weight']) and draw(st.booleans())
        values['fault.dead_foot'] = draw(st.integers(0, sum(counts)))
    if draw(st.booleans()):
        volts = sorted(draw(st.sets(st.floats(-999.0, 999.0), min_size=3, max_size=3)))
        names = ('voltage_min', 'voltage_initial', 'voltage_max')
        values |= {f'amplifier.{name}': volt for name, volt in zip(names, volts, strict=True)}
    if draw(st.booleans()):
        limits = sorted((draw(st.floats(-1.0, 1.0)), draw(st.floats(-1.0, 1.0))))
        values |= dict(zip(('limits.soft_min', 'limits.soft_max'), limits, strict=True))
        values |= {'stand.travel_min': -1.0, 'stand.travel_max': 1.0}
    if draw(st.booleans()):
        values['load_cell.hysteresis'] = draw(st.floats(0.0, 0.4))
        values['load_cell.range'] = draw(st.floats(1e-6, 1e6))
    if draw(st.booleans()):
        values |= {
            'contact.travel': 0.0,
            'contact.law': 'mdr',
            'contact.friction': 0.2,
            'contact.friction_velocity': 1e-3,
        }
        values |= {'contact.friction_cutoff': 1e-4, 'contact.friction_distance': 1e-6}
        values['contact.friction_rate'] = draw(st.floats(0.0, 0.01))
        values['contact.friction_ageing'] = draw(st.floats(0.0, 0.01))
        values['contact.loss_factor'] = draw(st.floats(0.0, 1.0))
    block_s, rate_hz, period_s = draw(st.sampled_from(PERIODS))
    values['sim.wake'] = draw(st.sampled_from((0.0, block_s)))
    return values | {'sim.block': block_s, 'trace.sample_rate': rate_hz, 'trace.period': period_s}
