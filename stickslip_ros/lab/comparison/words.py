# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Sentences and tables of a comparison, for screen and page."""

from collections.abc import Callable, Iterator, Sequence
from functools import partial
from typing import Any

import numpy as np

from stickslip_ros.lab.comparison.result import ROUNDING, Compared, Comparison, Threshold
from stickslip_ros.lab.measurements.measurement import Side
from stickslip_ros.lab.measurements.words import quantity_words, setting_words
from stickslip_ros.parameters import specs
from stickslip_ros.sections import Section
from stickslip_ros.units import MN, NM, display_unit, in_digits, with_unit

_NONE = '–'
_UNKNOWN = 'not in the file'
_SAME_SETTINGS = (
    'None. Parameters, seed, versions and constant columns are compared if both files have them.'
)
_OWN = 'own'  # the unit of the quantity
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
"""Rows of the numbers' table: name in docs/howto/compare.md, field, format, unit."""


def sections(
    comparison: Comparison, draw: Callable[[Sequence[Compared]], Any]
) -> Iterator[Section]:
    """Yield sections: findings, the two sides, numbers and figure of each quantity."""
    a, b = comparison.a, comparison.b
    yield Section(f'comparison of {a.origin} and {b.origin}', notes=sentences(comparison))
    sides: list[tuple[str, ...]] = [
        ('is a', a.kind, b.kind),
        ('rows', f'{a.rows}', f'{b.rows}'),
        *(
            (words, *(str(each.described.get(name, _UNKNOWN)) for each in (a, b)))
            for words, name in (('version', 'stickslip_ros'), ('seed', 'sim.seed'))
        ),
        ('parameters other than the default', _changed(a), _changed(b)),
    ]
    if a.notes or b.notes:
        sides.append(('notes', '\n'.join(a.notes), '\n'.join(b.notes)))
    yield Section('the two sides', sides, ('', f'A: {a.origin}', f'B: {b.origin}'))
    differing = [(e.name, *_unlike(e.name, e.a, e.b)) for e in comparison.differences]
    header = ('name', 'A', 'B') if differing else ()
    notes = () if differing else (_SAME_SETTINGS,)
    yield Section('settings of A and B that differ', differing, header, notes)
    for quantity in comparison.quantities:
        yield _numbers(quantity)._replace(draw=partial(draw, [quantity]))
        pairs = [
            (setting_words(part.at), part.threshold_a, part.threshold_b)
            for part in quantity.parts
            if part.threshold_a and part.threshold_b
        ]
        if pairs:
            yield from _thresholds(pairs)
    if comparison.steps:
        of_a, of_b = comparison.steps
        rows: list[tuple[str, ...]] = [('number', f'{of_a.count}', f'{of_b.count}', '')]
        for name, one_m, other_m in (
            ('mean', of_a.mean_m, of_b.mean_m),
            ('standard deviation', of_a.scatter_m, of_b.scatter_m),
            ('correlation length', of_a.correlation_m, of_b.correlation_m),
        ):
            rows.append((name, _number(one_m, '.4f', NM), _number(other_m, '.4f', NM), 'nm'))
        yield Section('steps in the second half of each run', rows, ('', 'A', 'B', 'unit'))


def sentences(comparison: Comparison) -> list[str]:
    """Return the findings as sentences."""
    lines, alignment = list[str](), comparison.alignment
    if alignment is not None:
        text = f'The times of B were shifted by {alignment.shift_s:.9g} s, as {alignment.method}'
        if alignment.correlation is not None:
            known = ' and '.join(quantity_words(name) for name in alignment.decided_by.split(', '))
            text += f' from {known}, with a correlation of {alignment.correlation:.6f}'
        elif alignment.decided_by:
            text += f' from the {alignment.decided_by}'
        if alignment.error_s is not None:
            text += f', with an error of {alignment.error_s:.2g} s'
        lines.append(f'{text}.')
        lines += [f'Doubtful: {each}.' for each in alignment.doubts]
    if comparison.window_s is not None:
        lines.append('The window of A is {:.9g} s to {:.9g} s.'.format(*comparison.window_s))
    return lines + [each for quantity in comparison.quantities for each in _findings(quantity)]


def _numbers(quantity: Compared) -> Section:
    """Return the numbers of a quantity: a column for each part, and one for all parts."""
    columns = [
        (setting_words(part.at) or 'whole run', part.agreement, part.at) for part in quantity.parts
    ]
    if len(columns) > 1:
        columns.append(('all', quantity.agreement, {}))
    factors = {_OWN: display_unit(quantity.unit)[0], '%': 100.0}
    rows = []
    for label, field, form, unit in _NUMBERS:
        shown = display_unit(quantity.unit)[1] if unit == _OWN else unit
        cells = []
        for _, agreement, known in columns:
            chi, cell = agreement.chi_square, {**vars(agreement)}
            if field == 'largest_at':  # the column names the other settings
                worst = agreement.largest_at.items()
                cells.append(
                    setting_words({name: each for name, each in worst if name not in known})
                )
            else:
                cell |= vars(chi) if chi else {}
                cells.append(_number(cell.get(field), form, factors.get(unit, 1)))
        if set(cells) != {_NONE}:
            rows.append((label, *cells, shown))
    header = 'B − A', *(name for name, _, _ in columns), 'unit'
    return Section(quantity_words(quantity.name), rows, header)


def _thresholds(pairs: Sequence[tuple[str, Threshold, Threshold]]) -> Iterator[Section]:
    """Yield the tables of thresholds of force curves."""
    zeros, tops, missing = list[Any](), list[Any](), list[str]()
    for name, a, b in pairs:
        zero_a_m, zero_b_m = a.zero_amplitude_m, b.zero_amplitude_m
        both = None if zero_a_m is None or zero_b_m is None else zero_b_m - zero_a_m
        missing += [f'{name}, {s}: {each.why}' for s, each in (('A', a), ('B', b)) if each.why]
        zeros.append((name, *(_number(each, '.3f', NM) for each in (zero_a_m, zero_b_m, both))))
        cells = [
            cell
            for each in (a, b)
            for cell in (f'{MN * each.saturation:.3f}', f'{NM * each.saturation_at_m:.5g}')
        ]
        tops.append((name, *cells, f'{MN * (b.saturation - a.saturation):.3f}'))
    yield Section('0-amplitude (nm)', zeros, ('preload', 'A', 'B', 'B − A'), missing)
    header = 'preload', 'A', 'at stroke (nm)', 'B', 'at stroke (nm)', 'B − A'
    yield Section('largest force (mN)', tops, header)


def _changed(side: Side) -> str:
    if side.changed is None:
        return _UNKNOWN
    return (
        '\n'.join(f'{name} = {_set(name, each)}' for name, each in side.changed.items()) or 'none'
    )


def _set(name: str, value: object) -> str:
    """Return the value of a parameter with its unit, or of another setting."""
    return f'{in_digits(value)} {specs()[name].unit if name in specs() else ""}'.rstrip()


def _unlike(name: str, *values: object) -> list[str]:
    """Return different values with their unit, as short as they differ."""
    shown = [_set(name, each) for each in values]
    return [*map(str, values)] if len({*shown}) < len(values) else shown


def _number(value: float | None, form: str, factor: float) -> str:
    return _NONE if value is None else f'{factor * value:{form}}'


def _findings(quantity: Compared) -> Iterator[str]:
    name, unit, agreement = quantity_words(quantity.name), quantity.unit, quantity.agreement
    if quantity.offset:
        yield (
            f'The {name} of B was shifted by {with_unit(quantity.offset, unit)}, the median of '
            'A − B, because its zero is arbitrary.'
        )
    count = f'{agreement.points} points' if agreement.points > 1 else '1 point'
    size = max(float(np.max(np.abs(part.a))) for part in quantity.parts)
    if abs(agreement.largest) <= ROUNDING * size:
        yield f'The {name} of B equals that of A at all {count}.'
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
            f'The difference is largest at {setting_words(agreement.largest_at)}: B − A is '
            f'{with_unit(agreement.largest, unit)}.'
        )
    if quantity.left_out:
        yield (
            f'{quantity.left_out} points of the {name} of A are left out: they are not finite, or '
            'have no counterpart in B.'
        )
    chi = agreement.chi_square
    if chi is not None:
        yield (
            f'Chi-square of the {name} is {chi.chi_square:.4g} for {chi.degrees_of_freedom} '
            'degrees of freedom. If A and B differed only by independent normal errors of the '
            f'given size, a value at least as large would have the probability {chi.p_value:.3g}.'
        )
