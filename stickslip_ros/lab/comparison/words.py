"""A comparison as sentences and table rows, the same on a screen and in the report."""

from collections.abc import Iterator, Mapping

import numpy as np

from stickslip_ros.lab.comparison.by_amplitude import FREQUENCY_COLUMN, PRELOAD_COLUMN
from stickslip_ros.lab.comparison.result import (
    AMPLITUDE_COLUMN,
    ROUNDING,
    TIME_COLUMN,
    Compared,
    ComparisonReport,
    Threshold,
)
from stickslip_ros.parameters import SENSORS, Scalar
from stickslip_ros.units import MN, NM, display_unit, with_unit

Section = tuple[str, tuple[str, ...], list[tuple[str, ...]]]  # title, header, rows
NAMES: Mapping[str, str] = {
    'step_length_m': 'step length',
    'energy_loss_per_step_j': 'friction loss per step',
    **{each.quantity: each.words for each in SENSORS},
    'voltage_v': 'voltage',
    'foot_m': 'foot displacement',
}
NONE = '–'
_OWN = 'own'  # stands for the unit of the quantity
_NUMBERS = (
    ('points', 'points', 'd', ''),
    ('bias (mean)', 'bias', '.5g', _OWN),
    ('RMS', 'rms', '.5g', _OWN),
    ('RMS / range of A', 'relative_rms', '.3g', '%'),
    ('largest', 'largest', '.5g', _OWN),
    ('largest at', 'largest_at', '', ''),
    ('correlation', 'correlation', '.6f', ''),
    ('chi-square', 'chi_square', '.4g', ''),
    ('degrees of freedom', 'degrees_of_freedom', 'd', ''),
    ('p-value', 'p_value', '.3g', ''),
    ('largest normalised residual', 'largest_residual', '.3g', 'sigma'),
    ('within 1 sigma', 'within_one_sigma', '.3g', '%'),
    ('within 2 sigma', 'within_two_sigma', '.3g', '%'),
    ('A within the 68 % band', 'within_68', '.3g', '%'),
    ('A within the 95 % band', 'within_95', '.3g', '%'),
    ('width of the 95 % band', 'width_95', '.4g', _OWN),
)
"""Rows of a table: what docs/howto/compare.md calls it, its field, its form, its unit."""


def sections(comparison: ComparisonReport) -> Iterator[Section]:
    """Yield the tables of a comparison: one per quantity, then what is read off the forces."""
    for quantity in comparison.quantities:
        yield _numbers(quantity)
        pairs = [
            (place(part.at), part.threshold_a, part.threshold_b)
            for part in quantity.parts
            if part.threshold_a and part.threshold_b
        ]
        if pairs:
            zeros = [(name, a.zero_amplitude_m, b.zero_amplitude_m) for name, a, b in pairs]
            yield (
                '0-amplitude (nm)',
                ('preload', 'A', 'B', 'B − A'),
                [
                    (
                        name,
                        _number(a_m, '.3f', NM),
                        _number(b_m, '.3f', NM),
                        _number(None if a_m is None or b_m is None else b_m - a_m, '.3f', NM),
                    )
                    for name, a_m, b_m in zeros
                ],
            )
            yield _saturations(pairs)
    if comparison.steps:
        a, b = comparison.steps
        rows: list[tuple[str, ...]] = [('number', f'{a.count}', f'{b.count}', '')]
        for name, of_a, of_b in (
            ('mean', a.mean_m, b.mean_m),
            ('standard deviation', a.scatter_m, b.scatter_m),
            ('correlation length', a.correlation_m, b.correlation_m),
        ):
            rows.append((name, _number(of_a, '.4f', NM), _number(of_b, '.4f', NM), 'nm'))
        yield 'steps in the second half of each run', ('', 'A', 'B', 'unit'), rows


def title(quantity: Compared) -> str:
    """Return the heading of a quantity."""
    return NAMES.get(quantity.name, quantity.name)


def place(at: Mapping[str, Scalar]) -> str:
    """Return where a part is, ``0.5 N`` or ``0.5 N, contact.friction 0.3``."""
    parts = [f'{at[PRELOAD_COLUMN]:g} N'] if PRELOAD_COLUMN in at else []
    for name, value in at.items():
        if name in {PRELOAD_COLUMN, AMPLITUDE_COLUMN, TIME_COLUMN}:
            continue
        shown = f'{value:g}' if isinstance(value, float) else str(value)
        parts.append(f'{shown} Hz' if name == FREQUENCY_COLUMN else f'{name} {shown}')
    if AMPLITUDE_COLUMN in at:
        parts.append(f'stroke {with_unit(float(at[AMPLITUDE_COLUMN]), "m")}')
    if TIME_COLUMN in at:
        parts.append(f'{at[TIME_COLUMN]:.9g} s')
    return ', '.join(parts)


def sentences(comparison: ComparisonReport) -> list[str]:
    """Return what was found, in sentences that state numbers and nothing else."""
    said, alignment = list[str](), comparison.alignment
    if alignment is not None:
        text = f'The times of B were shifted by {alignment.shift_s:.9g} s, as {alignment.method}'
        if alignment.correlation is not None:
            known = [NAMES.get(name, name) for name in alignment.decided_by.split(', ')]
            text += (
                f' from {" and ".join(known)}, whose correlation is {alignment.correlation:.6f}'
            )
        elif alignment.decided_by:
            text += f' from the {alignment.decided_by}'
        if alignment.error_s is not None:
            text += f', with a standard error of {alignment.error_s:.2g} s'
        if alignment.sample_s is not None:
            text += f', at a spacing of {alignment.sample_s:.4g} s'
        said.append(f'{text}.')
        said += [f'Doubtful: {each}.' for each in alignment.doubts]
    if comparison.window_s is not None:
        said.append('Of A {:.9g} s to {:.9g} s counts.'.format(*comparison.window_s))
    return said + [each for quantity in comparison.quantities for each in _found(quantity)]


def _numbers(quantity: Compared) -> Section:
    """Return the numbers of a quantity, a column for each part and one for all of them."""
    columns = [(place(part.at) or 'whole run', part.agreement, part.at) for part in quantity.parts]
    if len(columns) > 1:
        columns.append(('all', quantity.agreement, {}))
    factors = {_OWN: display_unit(quantity.unit)[0], '%': 100.0}
    rows = []
    for label, field, form, unit in _NUMBERS:
        shown = display_unit(quantity.unit)[1] if unit == _OWN else unit
        cells = []
        for _, agreement, known in columns:
            chi, cell = agreement.chi_square, {**vars(agreement)}
            if field == 'largest_at':  # of a place, what is not known already
                worst = agreement.largest_at.items()
                cells.append(place({name: each for name, each in worst if name not in known}))
            else:
                cell |= vars(chi) if chi else {}
                cells.append(_number(cell.get(field), form, factors.get(unit, 1)))
        if set(cells) != {NONE}:
            rows.append((label, *cells, shown))
    return title(quantity), ('B − A', *(name for name, _, _ in columns), 'unit'), rows


def _saturations(pairs: list[tuple[str, Threshold, Threshold]]) -> Section:
    header = ('preload', 'A', 'at stroke (nm)', 'B', 'at stroke (nm)', 'B − A')
    rows = []
    for name, a, b in pairs:
        cells = [
            cell
            for each in (a, b)
            for cell in (f'{MN * each.saturation:.3f}', f'{NM * each.saturation_at_m:.5g}')
        ]
        rows.append((name, *cells, f'{MN * (b.saturation - a.saturation):.3f}'))
    return 'largest force (mN)', header, rows


def _number(value: float | None, form: str, factor: float) -> str:
    return NONE if value is None else f'{factor * value:{form}}'


def _found(quantity: Compared) -> Iterator[str]:
    name, unit, agreement = title(quantity), quantity.unit, quantity.agreement
    if quantity.offset:
        yield (
            f'The {name} of B was moved by {with_unit(quantity.offset, unit)}, the median of '
            'A − B, because its zero is arbitrary.'
        )
    count = f'{agreement.points} points' if agreement.points > 1 else '1 point'
    if agreement.largest == 0.0:
        yield f'The {name} of B equals that of A at all {count}.'
    elif abs(agreement.largest) <= ROUNDING * max(
        float(np.max(np.abs(part.a))) for part in quantity.parts
    ):
        yield f'The {name} of B equals that of A at all {count}, but for rounding.'
    else:
        side = 'above' if agreement.bias > 0.0 else 'below'
        share = agreement.relative_rms
        of_range = '' if share is None else f', {100.0 * share:.3g} % of the range of A'
        yield (
            f'Over {count} the {name} of B is on average '
            f'{with_unit(abs(agreement.bias), unit)} {side} that of A; the RMS of the '
            f'difference is {with_unit(agreement.rms, unit)}{of_range}.'
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
