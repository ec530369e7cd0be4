"""A comparison in words and in rows of a table: the same on a screen and on a page."""

from collections.abc import Iterator, Mapping

import numpy as np

from stickslip_ros.parameters import Scalar
from stickslip_ros.study.comparison.agreement import ROUNDING
from stickslip_ros.study.comparison.points import PRELOAD
from stickslip_ros.study.comparison.result import (
    AMPLITUDE,
    TIME,
    UNITS,
    Agreement,
    Compared,
    Comparison,
    Part,
)
from stickslip_ros.units import display_unit, with_unit

Section = tuple[str, tuple[str, ...], list[tuple[str, ...]]]
"""Title, header, rows."""
NAMES: Mapping[str, str] = {
    'force_n': 'force',
    'step_length_m': 'step length',
    'energy_loss_per_step_j': 'friction loss per step',
    'position_m': 'position',
    'voltage_v': 'voltage',
    'foot_m': 'foot displacement',
}
NONE = '–'


def sections(comparison: Comparison) -> Iterator[Section]:
    """Yield the tables of a comparison: one per quantity, then what is read off the forces."""
    for quantity in comparison.quantities:
        yield _numbers(quantity)
        parts = [part for part in quantity.parts if part.threshold_a]
        if parts:
            yield _zeros(parts)
            yield _saturations(parts)


def title(quantity: Compared) -> str:
    """Return the heading of a quantity."""
    return NAMES.get(quantity.name, quantity.name)


def place(at: Mapping[str, Scalar]) -> str:
    """Return where a part is, ``0.5 N`` or ``0.5 N, contact.friction 0.3``."""
    parts = [f'{at[PRELOAD]:g} N'] if PRELOAD in at else []
    for name, value in at.items():
        if name in {PRELOAD, AMPLITUDE, TIME}:
            continue
        shown = f'{value:g}' if isinstance(value, float) else str(value)
        parts.append(f'{shown} Hz' if name == 'frequency_hz' else f'{name} {shown}')
    if AMPLITUDE in at:
        parts.append(f'stroke {with_unit(float(at[AMPLITUDE]), "m")}')
    if TIME in at:
        parts.append(f'{at[TIME]:.9g} s')
    return ', '.join(parts)


def sentences(comparison: Comparison) -> list[str]:
    """Return what was found, in sentences that state numbers and nothing else."""
    found = []
    if comparison.alignment is not None:
        found.append(_alignment(comparison))
    for quantity in comparison.quantities:
        found += _found(quantity)
    return found


def _agreement(
    unit: str, agreement: Agreement, known: Mapping[str, Scalar]
) -> list[tuple[str, str, str]]:
    """Return name, value and unit of each number; of the place, what is not known already."""
    factor, shown = display_unit(unit)
    worst = {name: value for name, value in agreement.largest_at.items() if name not in known}
    chi = agreement.chi_square
    return [
        ('points', str(agreement.points), ''),
        ('bias (mean)', f'{factor * agreement.bias:.5g}', shown),
        ('RMS', f'{factor * agreement.rms:.5g}', shown),
        ('RMS / range of A', _share(agreement.relative_rms), '%'),
        ('largest', f'{factor * agreement.largest:.5g}', shown),
        ('largest at', place(worst), ''),
        ('correlation', _number(agreement.correlation, '.6f'), ''),
        ('chi-square', _number(chi.chi_square if chi else None, '.4g'), ''),
        ('degrees of freedom', str(chi.degrees_of_freedom) if chi else NONE, ''),
        ('p-value', _number(chi.p_value if chi else None, '.3g'), ''),
        (
            'largest normalised residual',
            _number(chi.largest_residual if chi else None, '.3g'),
            'sigma',
        ),
        ('within 1 sigma', _share(chi.within_one_sigma if chi else None), '%'),
        ('within 2 sigma', _share(chi.within_two_sigma if chi else None), '%'),
    ]


def _numbers(quantity: Compared) -> Section:
    """Return the numbers of a quantity, a column for each part and one for all of them."""
    columns = [
        (place(part.at), _agreement(quantity.unit, part.agreement, part.at))
        for part in quantity.parts
    ]
    if len(columns) > 1:
        columns.append(('all', _agreement(quantity.unit, quantity.agreement, {})))
    header = ('B − A', *(name or 'whole run' for name, _ in columns), 'unit')
    rows = [
        (cells[0][0], *(cell[1] for cell in cells), cells[0][2])
        for cells in zip(*(told for _, told in columns), strict=True)
        if any(cell[1] != NONE for cell in cells)
    ]
    return title(quantity), header, rows


def _zeros(parts: list[Part]) -> Section:
    rows = []
    for part in parts:
        a, b = (
            None if each is None else each.zero_amplitude_m
            for each in (part.threshold_a, part.threshold_b)
        )
        both = None if a is None or b is None else b - a
        rows.append((place(part.at), *(_number(each, '.3f', 1e9) for each in (a, b, both))))
    return '0-amplitude (nm)', ('preload', 'A', 'B', 'B − A'), rows


def _saturations(parts: list[Part]) -> Section:
    header = ('preload', 'A', 'at stroke (nm)', 'B', 'at stroke (nm)', 'B − A')
    rows = []
    for part in parts:
        a, b = part.threshold_a, part.threshold_b
        assert a is not None
        assert b is not None
        told = [
            cell
            for each in (a, b)
            for cell in (f'{1e3 * each.saturation:.3f}', f'{1e9 * each.saturation_at_m:.5g}')
        ]
        rows.append((place(part.at), *told, f'{1e3 * (b.saturation - a.saturation):.3f}'))
    return 'largest force (mN)', header, rows


def _number(value: float | None, form: str, factor: float = 1.0, unit: str = '') -> str:
    return NONE if value is None else f'{factor * value:{form}}{unit}'


def _share(value: float | None) -> str:
    return _number(value, '.3g', 100.0)


def _alignment(comparison: Comparison) -> str:
    alignment = comparison.alignment
    assert alignment is not None
    told = f'The times of B were shifted by {alignment.shift_s:.9g} s, as {alignment.method}'
    if alignment.correlation is not None and alignment.sample_s is not None:
        told += (
            f' by cross-correlation at a spacing of {alignment.sample_s:.4g} s; the mean '
            f'coefficient at the best whole sample is {alignment.correlation:.6f}'
        )
    return f'{told}.'


def _found(quantity: Compared) -> Iterator[str]:
    name, unit, agreement = title(quantity), quantity.unit, quantity.agreement
    count = f'{agreement.points} points' if agreement.points > 1 else '1 point'
    if agreement.largest == 0.0:
        yield f'The {name} of B equals that of A at all {count}.'
    elif _is_rounding(quantity):
        yield f'The {name} of B equals that of A at all {count}, but for rounding.'
    else:
        side = 'above' if agreement.bias > 0.0 else 'below'
        yield (
            f'Over {count} the {name} of B is on average '
            f'{with_unit(abs(agreement.bias), unit)} {side} that of A; the RMS of the '
            f'difference is {with_unit(agreement.rms, unit)}{_of_range(agreement)}.'
        )
        yield (
            f'The difference is largest at {place(agreement.largest_at)}: B − A is '
            f'{with_unit(agreement.largest, unit)}.'
        )
    if quantity.left_out:
        yield (
            f'{quantity.left_out} points of the {name} of A have no counterpart in B, or are '
            'no numbers, and are left out.'
        )
    chi = agreement.chi_square
    if chi is not None:
        yield (
            f'Chi-square of the {name} is {chi.chi_square:.4g} for {chi.degrees_of_freedom} '
            'degrees of freedom. If the stated uncertainties were independent and normal and '
            'nothing else differed, a value at least so large would come up with probability '
            f'{chi.p_value:.3g}.'
        )


def _is_rounding(quantity: Compared) -> bool:
    largest = max(float(np.max(np.abs(part.curve.a))) for part in quantity.parts)
    return abs(quantity.agreement.largest) <= ROUNDING * largest


def _of_range(agreement: Agreement) -> str:
    share = agreement.relative_rms
    return '' if share is None else f', {100.0 * share:.3g} % of the range of A'


def axis_label(comparison: Comparison) -> str:
    """Return the label of the axis along which things are compared."""
    if comparison.axis == TIME:
        return 'time (s)'
    return f'stroke of the feet ({display_unit(UNITS["m"])[1]})'
