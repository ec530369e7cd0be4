# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Sums of powers and their roots, by Newton's method or, for many sums, by polynomials."""

import math
from functools import lru_cache, reduce

import numpy as np

from stickslip_ros.arrays import Array
from stickslip_ros.kernels.kernel import entry_point

NEWTON_ITERATIONS = 60
"""Enough for any start: the function is convex in log-log, so Newton's steps cannot cycle."""
NEWTON_TOLERANCE = 1e-8
"""Last change of a logarithm: the next one, about its square, is below rounding."""
LOG_X: Array = np.linspace(-100.0, 10.0, 2201, dtype=np.float64)
"""Logarithms of x, m, between which the iteration starts; two steps are then enough."""
OCTAVES = 13
"""Octaves that the polynomials cover, down from the largest sum."""
DEGREE = 7
PIECES = 10
"""Polynomials per octave for exponents from 1 on; smaller exponents have more. The relative error
is 1e-14, and 3e-14 for an exponent of 0.3: little more than Newton's."""
TABLES_KEPT = 8
_NODES: Array = np.cos(np.pi * (np.arange(DEGREE + 1) + 0.5) / (DEGREE + 1))
"""Chebyshev nodes between -1 and 1, the ends of a piece."""
_TO_COEFFICIENTS: Array = np.linalg.inv(np.vander(_NODES, increasing=True)).T


def power_sum(x: Array, prefactors: tuple[float, ...], exponents: tuple[float, ...]) -> Array:
    """Return sum_i Q_i |x|^n_i, of the shape of x."""
    terms = zip(prefactors, exponents, strict=True)
    return np.asarray(sum(q * np.abs(x) ** n for q, n in terms))


def solve_power_sum(
    total: Array | float, prefactors: tuple[float, ...], exponents: tuple[float, ...]
) -> Array:
    """
    Return x >= 0 with sum_i Q_i x^n_i = total, of any shape; 0 if the total is not above 0.

    If there are more totals than roots in a table of polynomials, the table is used.

    """
    totals = np.array(total, dtype=float)  # a copy: numba has another type for read-only arrays
    pieces = math.ceil(PIECES / min(1.0, *exponents))
    many = totals.size > OCTAVES * pieces * len(_NODES)
    if not many or not 0.0 < (largest := totals.max()) < math.inf:
        return _by_newton(totals, prefactors, exponents)
    _, octave = math.frexp(largest)
    lowest = octave - OCTAVES
    flat, roots = totals.ravel(), np.zeros(totals.size)
    table = _table(prefactors, exponents, pieces, octave)
    if _read_off(flat, table, lowest, pieces, roots):
        below = (flat > 0.0) & (flat < 2.0**lowest)
        roots[below] = solve_power_sum(flat[below], prefactors, exponents)
    return roots.reshape(totals.shape)


def _by_newton(
    totals: Array, prefactors: tuple[float, ...], exponents: tuple[float, ...]
) -> Array:
    roots = np.zeros(totals.size)
    terms, log_sums = _terms_of(prefactors, exponents)
    _iterate(totals.ravel(), terms, LOG_X, log_sums, roots)
    return roots.reshape(totals.shape)


@lru_cache(maxsize=64)
def _terms_of(prefactors: tuple[float, ...], exponents: tuple[float, ...]) -> tuple[Array, Array]:
    """Return rows of prefactor and exponent, and the logarithm of the sum at LOG_X, read-only."""
    terms = np.array([*zip(prefactors, exponents, strict=True)])
    return terms, reduce(np.logaddexp, [np.log(q) + n * LOG_X for q, n in terms])


@entry_point
def _iterate(totals: Array, terms: Array, log_x: Array, log_sums: Array, roots: Array) -> None:
    """
    Solve in log x and log total.

    In these coordinates the sum is convex and its slope lies between the smallest and the
    largest exponent, so the iteration converges from any start.

    """
    k = len(log_x) // 2
    for i in range(len(totals)):
        if not totals[i] > 0.0:
            continue
        log_total = math.log(totals[i])
        while k > 0 and log_sums[k] > log_total:
            k -= 1
        while k < len(log_x) - 2 and log_sums[k + 1] < log_total:
            k += 1
        share = (log_total - log_sums[k]) / (log_sums[k + 1] - log_sums[k])
        root = log_x[k] + share * (log_x[k + 1] - log_x[k])
        for _ in range(NEWTON_ITERATIONS):
            value = slope = 0.0
            for term in terms:
                power = term[0] * math.exp(term[1] * root)
                value += power
                slope += term[1] * power
            change = (math.log(value) - log_total) * value / slope
            root -= change
            if abs(change) < NEWTON_TOLERANCE:
                break
        roots[i] = math.exp(root)


@lru_cache(maxsize=TABLES_KEPT)
def _table(
    prefactors: tuple[float, ...], exponents: tuple[float, ...], pieces: int, octave: int
) -> Array:
    """
    Return polynomials for the roots of sums below 2^octave, read-only.

    Each of OCTAVES has ``pieces`` rows of coefficients, lowest power first, of a variable that
    goes from -1 to 1 in the piece; shape (OCTAVES pieces, DEGREE + 1), lowest sums first.

    """
    shares = (np.arange(pieces)[:, np.newaxis] + 0.5 * (1.0 + _NODES)) / pieces
    octaves = np.arange(octave - OCTAVES, octave)[:, np.newaxis, np.newaxis]
    roots = _by_newton(np.ldexp(1.0 + shares, octaves), prefactors, exponents)
    return np.asarray(roots.reshape(-1, len(_NODES)) @ _TO_COEFFICIENTS)


@entry_point
def _read_off(totals: Array, table: Array, lowest: int, pieces: int, roots: Array) -> bool:
    """Fill in the roots of all totals from 2^lowest on; return whether some lie below."""
    octave, start, per_start, some_below = -1, 0.0, 1.0, False
    for i in range(len(totals)):
        # The last octave mostly fits again: totals come in order, and `frexp` is a call.
        if not start <= totals[i] < 2.0 * start:
            octave = math.frexp(totals[i])[1] - 1
            start, per_start = math.ldexp(1.0, octave), math.ldexp(1.0, -octave)
            octave -= lowest
        if totals[i] > 0.0 and octave >= 0:
            share = pieces * (totals[i] * per_start - 1.0)
            piece = int(share)
            coefficients, place = table[pieces * octave + piece], 2.0 * (share - piece) - 1.0
            root = coefficients[DEGREE]
            for k in range(DEGREE - 1, -1, -1):
                root = coefficients[k] + place * root
            roots[i] = root
        elif totals[i] > 0.0:
            some_below = True
    return some_below
