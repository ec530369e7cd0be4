# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Immutable tree of all parameters, and its flat form ``{'group.name': value}``."""

import dataclasses
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from itertools import compress
from operator import attrgetter
from typing import Any, ClassVar, TypeAlias

from stickslip_ros.errors import OutOfRange, WrongKind, WrongUse
from stickslip_ros.parameters.arguments import PARAMETER_NAMES, checked_arguments
from stickslip_ros.parameters.declaration import (
    Checked,
    Spec,
    declared_by,
    find_spec,
    switch,
    with_fields,
)
from stickslip_ros.parameters.instrument_groups import (
    ClosedLoopParameters,
    FaultParameters,
    FrameIdParameters,
    JogParameters,
    LimitsParameters,
    RecordParameters,
    SimParameters,
    StepParameters,
    TraceParameters,
)
from stickslip_ros.parameters.physics_groups import (
    ActuatorParameters,
    AmplifierParameters,
    ContactParameters,
    FeetParameters,
    FrameParameters,
    FrictionLawParameters,
    RunnerParameters,
    StandParameters,
)
from stickslip_ros.parameters.sensors import (
    SENSORS,
    InterferometerParameters,
    LoadCellParameters,
    Sensor,
)
from stickslip_ros.sections import NotebookView, Section
from stickslip_ros.units import NS_PER_S

TRAVEL = 'stand.travel_min', 'stand.travel_max'
"""Parameters that limit a commanded position, and show its limits."""
Range: TypeAlias = tuple[float, float]
_PAPER: tuple[str, ...] = 'none', 'the stand of the paper'


@checked_arguments
@dataclass(frozen=True, kw_only=True)
@with_fields(
    {each.name: (each.group, field(default_factory=cache(each.group))) for each in SENSORS},
    'trace',
)
class Parameters(NotebookView, Checked):
    """All parameters, in groups; ``Parameters()`` is the test stand of the paper."""

    ranges: ClassVar[Mapping[str, Range]] = {}  # of assumed values, by name, as of a stage
    autostart: bool = switch(
        True, 'configure and activate the node without a manager', fixed=True, resumable=True
    )
    # Each default group is made once: equal keys of caches are then mostly the same object.
    sim: SimParameters = field(default_factory=cache(SimParameters))
    contact: ContactParameters = field(default_factory=cache(ContactParameters))
    friction_law: FrictionLawParameters = field(default_factory=cache(FrictionLawParameters))
    stand: StandParameters = field(default_factory=cache(StandParameters))
    feet: FeetParameters = field(default_factory=cache(FeetParameters))
    frame: FrameParameters = field(default_factory=cache(FrameParameters))
    runner: RunnerParameters = field(default_factory=cache(RunnerParameters))
    amplifier: AmplifierParameters = field(default_factory=cache(AmplifierParameters))
    actuator: ActuatorParameters = field(default_factory=cache(ActuatorParameters))
    step: StepParameters = field(default_factory=cache(StepParameters))
    jog: JogParameters = field(default_factory=cache(JogParameters))
    closed_loop: ClosedLoopParameters = field(default_factory=cache(ClosedLoopParameters))
    limits: LimitsParameters = field(default_factory=cache(LimitsParameters))
    load_cell: LoadCellParameters = field(default_factory=cache(LoadCellParameters))
    interferometer: InterferometerParameters = field(
        default_factory=cache(InterferometerParameters)
    )
    trace: TraceParameters = field(default_factory=cache(TraceParameters))
    frame_id: FrameIdParameters = field(default_factory=cache(FrameIdParameters))
    record: RecordParameters = field(default_factory=cache(RecordParameters))
    fault: FaultParameters = field(default_factory=cache(FaultParameters))

    @classmethod
    def group(cls) -> str:
        """Return no name: the root is not in a group."""
        return ''

    def check_together(self) -> None:
        """
        Refuse combinations of groups, and periods that are not multiples.

        A block has a whole number of samples, a wake-up and a trace message of blocks.

        """
        if self.contact.travel and self.stand.preload_end:
            limit, hint = 'a ramp, but contact.travel needs a constant preload', 'set either to 0'
            raise OutOfRange('stand.preload_end', self.stand.preload_end, 'N', limit, hint)
        if self.stand.weight and not any(self.feet.weight):
            limit, hint = 'true, but no foot carries the weight', 'set feet.weight'
            raise OutOfRange('stand.weight', True, '', limit, hint)
        for name in ('soft_min', 'soft_max'):
            self.check_travel(f'limits.{name}', getattr(self.limits, name))
        self.feet.check_foot('fault.dead_foot', self.fault.dead_foot)
        _check_multiple('sim.block', self.block_ns, 'sample of trace.sample_rate', self.sample_ns)
        _check_multiple('sim.wake', to_nanoseconds(self.sim.wake), 'sim.block', self.block_ns)
        _check_multiple('trace.period', self.trace_period_ns, 'sim.block', self.block_ns)

    def check_travel(self, name: str, x_m: float) -> None:
        """Refuse a place of the runner outside TRAVEL."""
        low_m, high_m = self.stand.travel_min, self.stand.travel_max
        if not low_m <= x_m <= high_m:
            limit = f'outside the travel, {low_m:g} to {high_m:g} m'
            hint = f'stay inside, or move {" and ".join(TRAVEL)}'
            raise OutOfRange(name, x_m, 'm', limit, hint)

    @property
    def sensors(self) -> tuple[Sensor, ...]:
        """The installed sensors, in the order of their columns in a trace."""
        enabled = [getattr(getattr(self, each.name), 'enabled', True) for each in SENSORS]
        return tuple(compress(SENSORS, enabled))

    @property
    def block_ns(self) -> int:
        """Period of updates, ns."""
        return to_nanoseconds(self.sim.block)

    @property
    def sample_ns(self) -> int:
        """Period of the samples of the trace, ns; OutOfRange if it is not whole."""
        period_ns = NS_PER_S / self.trace.sample_rate
        if abs(period_ns - round(period_ns)) > 1e-6:
            limit = f'a period of {period_ns:.9g} ns, not a whole number of nanoseconds'
            hint = 'take a rate such as 10e3, 20e3, 50e3 or 100e3 Hz'
            raise OutOfRange('trace.sample_rate', self.trace.sample_rate, 'Hz', limit, hint)
        return round(period_ns)

    @property
    def trace_period_ns(self) -> int:
        """Period of the messages of the trace, ns."""
        return to_nanoseconds(self.trace.period)

    def flat(self) -> dict[str, Any]:
        """Return ``{'group.name': value}`` in the order of declaration."""
        return dict(zip(_SPECS, _values_of(self), strict=True))

    @checked_arguments
    def updated(self, values: Mapping[str, object]) -> 'Parameters':
        """
        Return a copy with other values, ``{'stand.preload': 0.25}``; texts are converted.

        An element of an array is ``feet.share[1]``, from 0. A given value loses its range.

        Raises
        ------
        UnknownName
            If a name is not declared.
        WrongKind, OutOfRange
            If a value is not allowed, or an element does not exist.

        """
        checked: dict[str, dict[str, Any]] = {}
        for name, value in values.items():
            group, _, leaf = str(name).rpartition('.')
            found, own = spec_of(str(name)).check(name, value), checked.setdefault(group, {})
            leaf, bracket, number = leaf.partition('[')
            if bracket:
                elements = list(own.get(leaf, getattr(getattr(self, group), leaf)))
                elements[_place_in(elements, str(name), number)] = found
                found = tuple(elements)
            own[leaf] = found
        changes = checked.pop('', {})
        for group, leaves in checked.items():
            changes[group] = getattr(self, group).with_checked(leaves)
        return self.with_checked(changes).with_ranges(self.ranges, values)

    def with_ranges(self, ranges: Mapping[str, Range], given: Iterable[str] = ()) -> 'Parameters':
        """Return a copy with ranges for its assumed values, except those in ``given``."""
        if not ranges and not self.ranges:
            return self
        arrays = {name.partition('[')[0] for name in given}
        kept = {
            name: each for name, each in ranges.items() if name.partition('[')[0] not in arrays
        }
        return self.with_checked({'ranges': kept})

    def value(self, name: str) -> Any:
        """Return the value of a parameter, or of an element of an array, ``feet.share[1]``."""
        array, bracket, number = name.partition('[')
        found = attrgetter(array)(self)
        return found[_place_in(found, name, number)] if bracket else found

    def sections(self) -> list[Section]:
        """Return a table of the values that differ from the stand of the paper."""
        rows: list[tuple[Any, ...]] = [
            (name, list(value) if spec_of(name).is_array else value, spec_of(name).unit)
            for name, value in self.changed().items()
        ]
        return [Section('parameters that differ from the default', rows or [_PAPER])]

    def changed(self) -> dict[str, Any]:
        """Return the values that differ from the default."""
        return {name: v for name, v in self.flat().items() if v != spec_of(name).default}


def to_nanoseconds(time_s: float) -> int:
    """Convert seconds to whole nanoseconds, rounding to the nearest."""
    return round(time_s * NS_PER_S)


def specs() -> dict[str, Spec]:
    """Return the declaration of every parameter, ``{'group.name': Spec}``."""
    return dict(_SPECS)


def spec_of(name: str) -> Spec:
    """
    Return the declaration of a parameter, or of an element of an array, ``feet.share[1]``.

    UnknownName suggests the nearest names.

    """
    array, bracket, _ = name.partition('[')
    spec = find_spec(_SPECS, array, 'see docs/reference/parameters.md')
    if not bracket:
        return spec
    if not spec.is_array:
        raise WrongKind('parameter', name, 'an element of an array', f'write {array}')
    return dataclasses.replace(spec, default=spec.default[0])


def column_name(name: str) -> str:
    """Return a parameter with its unit, ``load_cell.stiffness [N/m]``."""
    unit = spec_of(name).unit
    return f'{name} [{unit}]' if unit else name


def bare_name(column: str) -> str:
    """Return the parameter of a column that ``column_name`` named."""
    return column.partition(' [')[0]


def is_fault(name: str) -> bool:
    """Return whether a parameter is a fault that may change while the drive runs."""
    return name.startswith('fault.') and spec_of(name).live


def differ_when_built(one: Parameters, other: Parameters) -> bool:
    """Return whether two sets of parameters differ in more than faults."""
    values = other.flat()
    return any(value != values[name] for name, value in one.flat().items() if not is_fault(name))


def parse_assignments(
    assignments: Iterable[str], form: str = '--set group.name=value'
) -> dict[str, str]:
    """Split ``name=value`` texts of an option; WrongKind shows the ``form`` without ``=``."""
    pairs: dict[str, str] = {}
    for text in assignments:
        name, equals, value = text.partition('=')
        if not equals:
            raise WrongKind(form.partition(' ')[0], text, 'an assignment', f'write {form}')
        pairs[name.strip()] = value.strip()
    return pairs


def _place_in(elements: Sequence[Any], name: str, number: str) -> int:
    """Return the index of an element from the end of its name, as ``1]``."""
    places = [f'{place}]' for place in range(len(elements))]
    if number not in places:
        limit = f'not one of its elements, 0 to {len(elements) - 1}'
        raise OutOfRange('parameter', name, '', limit, f'write {name.partition("[")[0]}[0]')
    return places.index(number)


def _check_multiple(name: str, period_ns: int, of_name: str, of_ns: int) -> None:
    if period_ns % of_ns:
        limit = f'not a multiple of one {of_name}, {of_ns} ns'
        raise OutOfRange(name, period_ns, 'ns', limit, 'change one of the two')


def _refuse_to_set(group: Checked, name: str, value: object) -> None:
    full = f'{type(group).group()}.{name}'.lstrip('.')
    spec_of(full)
    right = f'parameters = parameters.updated({{{full!r}: {value!r}}})'
    raise WrongUse(f'{full} cannot be set, as parameters do not change; write {right}')


for _group in (Parameters, *(e.type for e in dataclasses.fields(Parameters) if not e.metadata)):
    _group.__setattr__ = _refuse_to_set  # type: ignore[method-assign]
_SPECS = declared_by(Parameters)
PARAMETER_NAMES.extend(_SPECS)
_values_of = attrgetter(*_SPECS)
