# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Controls of the page, from the tables of commands, services and parameters."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

from stickslip_ros.errors import StickSlipError, quoted
from stickslip_ros.instrument.commands import number_name
from stickslip_ros.instrument.reports import Status
from stickslip_ros.interface.messages import STAMPED_FIELDS
from stickslip_ros.interface.topics import COMMAND_TOPICS, SERVICES, Topic
from stickslip_ros.lab.design.shapes import SHAPES
from stickslip_ros.lab.measurements.measurement import TimeRun, measured
from stickslip_ros.lab.measurements.vocabulary import OVER_TIME
from stickslip_ros.lab.panel.model import FEET, HISTORY_SPANS_S, RANGE, SCOPE_CYCLES
from stickslip_ros.lab.panel.settings import (
    in_shown_units,
    is_of_start,
    read_setting,
    shown_value,
    typed_value,
    uploaded,
)
from stickslip_ros.lab.readers.formats import SUFFIXES
from stickslip_ros.message_types import JOINT_STATE, SET_BOOL
from stickslip_ros.parameters import SENSORS, TRAVEL, is_fault, spec_of, specs
from stickslip_ros.parameters.stages import stage_files
from stickslip_ros.recording.layout import STORAGES
from stickslip_ros.units import display_unit, parse_quantity


class NumberField(NamedTuple):
    """Limits, first value and text of a number: numbers, or parameters that hold them."""

    low: float | str | None = None
    high: float | str | None = None
    start: float | str = 0.0
    words: str = ''  # in place of the limits


class Control(NamedTuple):
    """How the page shows a command."""

    way: str = 'form'  # or a special control
    signed: str | None = None  # number whose sign is the direction: one button each
    about: str = ''  # text with values of parameters
    beside: tuple[str, ...] = ()  # live parameters next to it


SPECIAL = {
    'voltage': Control('slide'),
    'jog': Control('hold', 'frequency', 'of {step.amplitude} V; keys ← →'),
    'waveform': Control('wave'),
    'sawtooth': Control(signed='frequency'),
    'steps': Control(
        signed='steps',
        about='of {step.amplitude} V, {step.frequency} Hz',
        beside=('step.amplitude', 'step.frequency'),
    ),
    'position': Control(beside=('closed_loop.velocity', 'limits.soft_min', 'limits.soft_max')),
}
"""Commands that are more than a form."""
_AMPLITUDE = NumberField(0.0, RANGE, 'step.amplitude')
_FREQUENCY = NumberField(0.0, 'amplifier.frequency_max', 'step.frequency')
_ENDLESS = NumberField(0, words='0: until stopped')
NUMBER_FIELDS = {
    ('voltage', 'voltage'): NumberField('amplifier.voltage_min', 'amplifier.voltage_max'),
    ('sawtooth', 'amplitude'): _AMPLITUDE,
    ('sawtooth', 'frequency'): _FREQUENCY,
    ('sawtooth', 'steps'): _ENDLESS,
    ('steps', 'steps'): NumberField(0, start=10),
    ('waveform', 'amplitude'): _AMPLITUDE,
    ('waveform', 'frequency'): _FREQUENCY,
    ('waveform', 'cycles'): _ENDLESS,
    ('jog', 'frequency'): _FREQUENCY._replace(start=200.0),
    ('position', 'x'): NumberField(*TRAVEL, 1e-6),
    ('position', 'step'): NumberField(start=1e-7, words='nm, relative'),
    ('load', 'force.x'): NumberField('-stand.load_limit', 'stand.load_limit'),
    ('preload', 'preload'): NumberField(0.0, 'stand.preload_limit', 'stand.preload'),
}
"""Fields of the numbers of commands."""
ALARMS = (
    Status.END_STOP_REACHED
    | Status.RANGE_LIMIT_REACHED
    | Status.FOLLOWING_LIMIT_REACHED
    | Status.MOVEMENT_FAILED
    | Status.REFUSED
    | Status.FAULT
    | Status.BEAM_LOST
    | Status.FORCE_OVERRANGE
)
SHAPE_ROWS = 100  # rows of a curved part of a shape
WAVE = ('amplitude V', 'frequency Hz', 'cycles')  # numbers of a waveform with a named shape


def sheet() -> dict[str, Any]:
    """Return the controls and lamps of a page that is attached to a drive."""
    return {
        'kind': 'drive',
        **lamps(),
        'commands': [  # lockstep and joints are for programs
            _command(each)
            for each in COMMAND_TOPICS
            if not each.switches and each.type_name != JOINT_STATE
        ],
        'services': {
            each.name.removeprefix('~/'): {
                'text': each.text,
                'is_switch': each.type_name == SET_BOOL,
            }
            for each in SERVICES
        },
        'parameters': {name: _parameter(name) for name in specs()},
        'faults': [name for name in specs() if is_fault(name)],
        'stages': list(stage_files()),
    }


def lamps() -> dict[str, Any]:
    """Return the parts of every page: status bits, readings, choices of the scope."""
    return {
        'bits': [
            {'bit': int(bit), 'name': bit.name, 'text': bit.text, 'is_alarm': bool(bit & ALARMS)}
            for bit in Status
        ],
        'sensors': [
            {
                'name': each.reading,
                'words': each.words.capitalize(),
                'text': f'{each.text}, mean of 40 ms',
                'is_optional': bool(each.switch),
                'unit': display_unit(each.unit)[1],
                'factor': display_unit(each.unit)[0],
            }
            for each in SENSORS
        ],
        'cycles': SCOPE_CYCLES,
        'spans_s': HISTORY_SPANS_S,
    }


def read_waveform(content: bytes, name: str) -> list[list[float]]:
    """Return rows of time, s, from 0, and voltage, V, of an uploaded table or recording."""
    suffix = Path(name).suffix.lower()
    try:
        with uploaded(content, suffix if suffix in {*SUFFIXES, *STORAGES} else '.csv') as path:
            run = measured(path, kind=OVER_TIME, wanted=['voltage_v'])
    except StickSlipError as error:
        why, _, hint = str(error).rpartition('; ')
        if '--' in hint:  # an option of a command line
            hint = 'head the columns as time (ms), voltage (V)'
        raise StickSlipError(f'{why}; {hint}') from None
    voltage = run.series.get('voltage_v') if isinstance(run, TimeRun) else None
    if voltage is None:
        raise StickSlipError(f'{name} holds no voltage; give a table of times and voltages')
    time_s = voltage.time_s - voltage.time_s[0]
    return [list(row) for row in zip(time_s.tolist(), voltage.value.tolist(), strict=True)]


def read_parameter(name: object, value: object) -> tuple[str, Any]:
    """Return a live parameter with its checked value; refuse others."""
    if not isinstance(name, str) or not spec_of(name).live:
        raise StickSlipError(f'{quoted(name)} is not a live parameter; set it by Apply')
    return name, read_setting(name, value)


def read_numbers(topic: Topic, values: Any) -> Any:
    """Return the numbers of fields, whose texts may have units; refuse other texts."""
    if not isinstance(values, list):
        return values
    return [
        _read_number(topic.request, label, value, '' if len(values) == 1 else f'{label} ')
        for label, value in zip(topic.numbers, values, strict=False)
    ] + values[len(topic.numbers) :]


def read_number(content: bytes, place: str) -> float:
    """Return the number of a field, such as that of ``waveform amplitude V``, in SI units."""
    command, _, label = place.partition(' ')
    return float(_read_number(command, label, content.decode(errors='replace'), place))


def _read_number(command: str, label: str, value: Any, place: str) -> Any:
    name, _, unit = label.partition(' ')
    found = value
    if isinstance(value, str):
        found = parse_quantity(typed_value(number_name(command, label), value, unit), unit)
    if found is None:
        shown = display_unit(unit)[1]
        wanted = f'a number in {shown}, such as 120.5' if shown else 'a whole number, such as 10'
        named = f'{name} ' * bool(place) + quoted(value)
        raise StickSlipError(f'{named} is not a number; give {wanted}')
    return found


def _command(topic: Topic) -> Mapping[str, Any]:
    name, is_vector = topic.request, topic.type_name in STAMPED_FIELDS
    wave = {
        'shapes': {
            shape_name: {'rows': shape.rows(SHAPE_ROWS).tolist(), 'source': shape.source}
            for shape_name, shape in SHAPES.items()
        },
        'numbers': [_number(name, each) for each in WAVE],
    }
    return {
        'name': name,
        'text': in_shown_units(topic.text),
        **SPECIAL.get(name, Control())._asdict(),
        'step': _number(name, 'step m') if (name, 'step') in NUMBER_FIELDS else None,
        'numbers': [_number(name, each) for each in topic.numbers[: 1 if is_vector else None]],
        'wave': wave if topic.is_table else None,
    }


def _number(command: str, label: str) -> dict[str, Any]:
    """Return the field of a number, from its name and unit."""
    name, _, unit = label.partition(' ')
    factor, shown = display_unit(unit)
    field = NUMBER_FIELDS.get((command, name), NumberField())
    return {'name': name, 'label': label, 'unit': shown, 'factor': factor, **field._asdict()}


def _parameter(name: str) -> dict[str, Any]:
    """Return the field of a parameter, from its declaration."""
    spec = spec_of(name)
    factor, unit = display_unit(spec.unit)
    return {
        'name': name,
        'text': in_shown_units(spec.text),
        'unit': unit,
        'factor': factor,
        'low': spec.minimum,
        'high': FEET if name == 'fault.dead_foot' else spec.maximum,
        'default': shown_value(spec.default, spec.unit),
        'source': spec.source,
        'kind': spec.kind.__name__,
        'choices': ('false', 'true') if spec.kind is bool else spec.choices,
        'is_live': spec.live,
        'is_fixed': is_of_start(name),
    }
