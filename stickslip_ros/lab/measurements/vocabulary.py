# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Quantities of measured tables: kinds, units, limits, usual names."""

import dataclasses
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

from stickslip_ros.arrays import Array
from stickslip_ros.lab.measurements.numbers import BACK, NUMBERS, SHEET_SHARE, sigma_name
from stickslip_ros.lab.readers.columns import Column, plain
from stickslip_ros.lab.readers.units import factor_of
from stickslip_ros.lab.readers.vocabulary import Vocabulary
from stickslip_ros.parameters import AMPLITUDE_SPEC, FREQUENCY_SPEC, SENSORS, Spec, spec_of
from stickslip_ros.units import unit_of

BY_AMPLITUDE, OVER_TIME = 'experiment by amplitude', 'experiment over time'
LARGEST_AMPLITUDE_M = 1e-3
"""Ten times the stroke of a usual piezo stack; a larger value has a wrong unit."""
_LARGEST = {'N': 1e3, 'm': 1.0, 'm/s': 10.0, 'Hz': 1e6, 's': 10.0, 'V': 1e5, 'kg': 10.0, 'F': 1e-3}
_NUMBERS = [name for name, each in NUMBERS.items() if each.words]
USUAL: Mapping[str, tuple[str, ...]] = {
    'time_s': ('time', 't', 'x axis', 'x value', 'zeit'),
    'position_m': ('position', 'pos', 'x', 'displacement', 'weg', 'auslenkung'),
    'voltage_v': ('voltage', 'u', 'v', 'piezo', 'piezo voltage', 'spannung', 'piezospannung'),
    'foot_m': ('foot', 'feet', 'stroke', 'hub', 'fuß', 'fuss'),
    'preload_n': ('preload', 'fp', 'normal force', 'vorlast', 'vorspannkraft', 'normalkraft'),
    'amplitude_m': ('amplitude', 'stroke', 'hub'),
    'frequency_hz': ('frequency', 'freq', 'f', 'frequenz'),
    'load_n': ('external force', 'external load'),
    'direction': ('direction', 'richtung'),
    'tolerance': ('tolerance', 'toleranz'),
    'displacement_m': ('displacement', 'distance', 'weg'),
    'normal_n': ('normal',),
    'travel_m': ('travel',),
    'rig_n_per_m': ('rig', 'rig stiffness', 'machine stiffness'),
    'steps': ('steps', 'number of steps', 'cycles', 'pulses', 'schritte'),
    **{name: tuple(each.words.split(', ')) for name, each in NUMBERS.items() if each.words},
    **{each.quantity: (each.words,) for each in SENSORS if each.switch},
}
"""Usual names of quantities, in lower case, words separated by one blank."""
_SIGMAS = re.compile(
    r'(\b(sigma|σ|std|sd|stdev|std dev|standard (deviation|error)|uncertainty|err|error|'
    r'unsicherheit|standardabweichung|fehler)\b|±)( (of|der|des)\b)?'
)
_DIRECTED = re.compile(r'\b(up|forwards?|fwd|(down|backwards?|back|bwd))\b')
_MEAN = re.compile(r'\b(mean|average|avg|mittelwert|mittlere)\b( (of|der|des)\b)?')


def _measured(unit: str, text: str, largest: float) -> Spec:
    return Spec(float, 0.0, unit, 'measured', text, -largest, largest)


def _sigma(unit: str, text: str) -> Spec:
    return Spec(float, 0.0, unit, 'measured', f'standard deviation of {text}', 0.0)


def _number(name: str) -> Spec:
    spec = _measured(unit_of(name), name, _LARGEST.get(unit_of(name), 1e12))
    return dataclasses.replace(spec, minimum=0.0) if NUMBERS[name].is_of_sheet else spec


POINT_COLUMNS: Mapping[str, Spec] = {
    'preload_n': spec_of('stand.preload'),
    'amplitude_m': dataclasses.replace(AMPLITUDE_SPEC, maximum=LARGEST_AMPLITUDE_M),
    'frequency_hz': FREQUENCY_SPEC,
    'voltage_v': Spec(float, 0.0, 'V', 'measured', 'saw-tooth, peak to peak', 0.0, 1e5),
    'load_n': _measured('N', 'constant force on the runner along +x', 1e3),
    'direction': _measured('', 'up or down', 1.0),
    'tolerance': Spec(float, 100.0 * SHEET_SHARE, '%', 'measured', 'standard error', 1e-3, 1e3),
    'travel_m': _measured('m', 'net motion in a number of steps', 1.0),
    'steps': _measured('', 'number of steps', 1e12),
    'row': _measured('', 'number of a row of a friction loop', 1e12),
    'displacement_m': _measured('m', 'displacement of one sphere, with that of the rig', 1.0),
    'normal_n': dataclasses.replace(_measured('N', 'normal force on it', 1e3), minimum=0.0),
    'rig_n_per_m': Spec(float, 0.0, 'N/m', 'measured', 'stiffness of the rig', 0.0, 1e12),
    **{name: _number(name) for name in _NUMBERS},
    'amplitude_sigma_m': _sigma('m', 'the amplitude'),
    **{sigma_name(name): _sigma(unit_of(name), name) for name in _NUMBERS},
}
TIME_COLUMNS: Mapping[str, Spec] = {
    'time_s': _measured('s', 'time of the sample; each after the one before', 1e12),
    **{each.quantity: _measured(each.unit, each.label, each.largest) for each in SENSORS},
    'voltage_v': _measured('V', 'voltage at the piezo', 1e5),
    'foot_m': _measured('m', 'displacement of the feet', 1.0),
    **{sigma_name(each.quantity): _sigma(each.unit, f'the {each.words}') for each in SENSORS},
    'voltage_sigma_v': _sigma('V', 'the voltage'),
    'foot_sigma_m': _sigma('m', 'the displacement'),
}
EXPERIMENT_COLUMNS = {BY_AMPLITUDE: POINT_COLUMNS, OVER_TIME: TIME_COLUMNS}
MEASURED = {
    BY_AMPLITUDE: tuple(_NUMBERS),
    OVER_TIME: (*(each.quantity for each in SENSORS), 'voltage_v', 'foot_m'),
}
"""Measured columns; a table needs at least one."""


@dataclass(frozen=True, eq=False)
class MeasuredTable:
    """A measured table."""

    origin: str  # file
    kind: str  # BY_AMPLITUDE or OVER_TIME
    columns: dict[str, Array]  # SI, shape (rows,); over time, NaN for an empty cell
    notes: tuple[str, ...] = ()  # comment lines above the header
    recognised: tuple[Column, ...] = ()  # recognised columns
    unread: tuple[str, ...] = ()  # headers of columns that were not read
    gaps: tuple[str, ...] = ()  # notes on omitted rows and on times


def recognised(bare: str, unit: str, specs: Mapping[str, Spec]) -> str | None:
    """Return the quantity of a name (last of a path); the unit decides between two."""
    name = plain(_MEAN.sub('', plain(bare.rpartition('/')[2])))
    if not name and unit and 'time_s' in specs and factor_of(unit, 's'):
        return 'time_s'
    quantity = plain(_SIGMAS.sub('', name))
    for target in _usually(quantity):
        column = target if quantity == name else sigma_name(target)
        if column in specs and (not unit or factor_of(unit, specs[column].unit)):
            return column
    return None


def _usually(name: str) -> Iterator[str]:
    """Yield the quantities with a usual name, with or without a direction (``step up``)."""
    way = _DIRECTED.search(name)
    of_both = plain(_DIRECTED.sub('', name)) or 'step'
    for target, usual in USUAL.items():
        if way and target in BACK and of_both in usual:
            yield BACK[target] if way[2] else target
        elif name in usual:
            yield target


def _sign_of_way(text: str) -> str:
    """Return the sign of a direction's word as text; '' for other text."""
    way = _DIRECTED.fullmatch(text)
    if way is not None:
        return '-1' if way[2] else '1'
    return text if text in {'1', '-1', '+1'} else ''


def _vocabulary(
    specs: Mapping[str, Spec], measured: Iterable[str], needed: Mapping[str, Sequence[str]]
) -> Vocabulary:
    sigmas = {sigma_name(name): name for name in specs if sigma_name(name) in specs}
    sigmas = {sigma: name for sigma, name in sigmas.items() if sigma != name}
    return Vocabulary(
        quantities=specs,
        recognise=lambda name, unit: recognised(name, unit, specs),
        conditions=specs.keys() - sigmas.keys() - set(measured),
        sigmas=sigmas,
        needed=needed,
        words={'direction': _sign_of_way} if 'direction' in specs else {},
    )


_NEEDED = {name: (name, *NUMBERS[name].settings, sigma_name(name)) for name in NUMBERS}
_NEEDED |= {'travel_m': ('travel_m', 'steps', *NUMBERS['step_length_m'].settings)}
VOCABULARIES = {
    BY_AMPLITUDE: _vocabulary(POINT_COLUMNS, (*_NUMBERS, 'travel_m', 'steps'), _NEEDED),
    OVER_TIME: _vocabulary(TIME_COLUMNS, MEASURED[OVER_TIME], {}),
}
"""Vocabularies of the readers, by kind of table."""
