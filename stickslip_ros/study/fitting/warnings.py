"""What a user must know before believing a fit."""

from collections.abc import Iterator

import numpy as np

from stickslip_ros.study.fitting.fit import Estimate, Fit

CORRELATED = 0.95
CONDITION_MAX = 30.0
"""Condition number from which parameters are collinear (Belsley, Kuh, Welsch 1980)."""
P_VALUE_MIN = 0.01
SHOWN = 0.1
"""Part of a combination from which a parameter is named."""


def warnings_of(fit: Fit) -> tuple[str, ...]:
    """Return sentences about what is doubtful in a fit; none if nothing is."""
    return (
        *_search_warnings(fit),
        *(text for one in fit.estimates for text in _estimate_warnings(one)),
        *_trade_warnings(fit),
    )


def _search_warnings(fit: Fit) -> Iterator[str]:
    if not fit.converged:
        yield 'the search did not converge: raise --starts, or narrow --bounds'
    if not fit.steady:
        yield f'some runs are not steady after {max(fit.problem.cycles)} steps'
    if fit.rivals:
        yield (
            f'{fit.rivals} of {len(fit.searches)} searches ended in another minimum that the '
            'points do not rule out at 95 %: the intervals hold for this one only'
        )
    if fit.p_value is not None and fit.p_value < P_VALUE_MIN:
        yield (
            f'p-value {fit.p_value:.2g}: the model misses the points by more than their standard '
            'errors; either these are too small or the model is wrong, and the intervals with it'
        )


def _estimate_warnings(one: Estimate) -> Iterator[str]:
    if one.at_bound:
        yield f'{one.name} sits on its bound and was held there: no standard error'
    elif one.inert:
        yield f'{one.name} does not change the forces at all'
    elif one.undetermined:
        yield f'{one.name} is not determined: others make up for any change of it'
    elif one.standard_error > abs(one.value):
        yield f'{one.name} has a standard error above its value'


def _trade_warnings(fit: Fit) -> Iterator[str]:
    names = [one.name for one in fit.estimates]
    for row, column in zip(*np.triu_indices(len(names), k=1), strict=True):
        together = float(fit.correlation[row, column])
        if abs(together) > CORRELATED:
            yield f'{names[row]} and {names[column]} are correlated by {together:+.3f}'
    doubt = fit.uncertainty
    if doubt.condition > CONDITION_MAX:
        parts = [
            f'{part:+.2f} {name}'
            for name, part in zip(names, doubt.weakest, strict=True)
            if abs(part) > SHOWN
        ]
        yield (
            f'condition number {doubt.condition:.3g}, above {CONDITION_MAX:g}: the points hardly '
            f'determine the combination {" ".join(parts)} (effects scaled to equal size)'
        )
