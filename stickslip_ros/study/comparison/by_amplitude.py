"""Force curves against each other: same preload, B interpolated onto A's amplitudes."""

import numpy as np

from stickslip_ros.contact.profile import Array
from stickslip_ros.parameters import Scalar
from stickslip_ros.study.comparison.agreement import agreement_of, threshold_of
from stickslip_ros.study.comparison.points import AMPLITUDE, PRELOAD, SAME, PointTable
from stickslip_ros.study.comparison.refusal import Incomparable
from stickslip_ros.study.comparison.result import Compared, Curve, Part, Threshold

FORCE = 'force_n'


def compare_points(a: PointTable, b: PointTable) -> tuple[Compared, ...]:
    """
    Compare every quantity that both tables have.

    Raises
    ------
    Incomparable
        If one varies what the other does not say, or no point of A lies within B.

    """
    names = [name for name in a.values if name in b.values]
    if not names:
        problem = f'has {", ".join(b.values)}, {a.side.origin} has {", ".join(a.values)}'
        mend = 'a held runner has a force, a free one (load_cell.contact=absent) steps'
        raise Incomparable(b.side.origin, problem, mend)
    keys = [PRELOAD, *_matched(a, b)]
    shared = [at for at in a.groups(keys) if b.rows_at(at)]
    return tuple(_compare(a, b, shared, name) for name in names)


def _matched(a: PointTable, b: PointTable) -> list[str]:
    """Return the columns, beside the preload, by which rows are matched."""
    varied = list(dict.fromkeys([*a.varied(), *b.varied()]))
    for name in varied:
        for table, other in ((a, b), (b, a)):
            if name not in table.keys:
                problem = f'varies {name}, of which {table.side.origin} says nothing'
                raise Incomparable(other.side.origin, problem, 'keep one value of it')
    return varied


def _compare(a: PointTable, b: PointTable, shared: list[dict[str, Scalar]], name: str) -> Compared:
    parts = [part for at in shared if (part := _part(a, b, at, name)) is not None]
    if not parts:
        raise _nothing_shared(a, b)
    curve = _joined([part.curve for part in parts])
    places = [
        {**part.at, AMPLITUDE: float(amplitude_m)}
        for part in parts
        for amplitude_m in part.curve.x
    ]
    left_out = len(a.amplitude_m) - len(curve.x)
    return Compared(name, agreement_of(curve, places.__getitem__), tuple(parts), left_out)


def _part(a: PointTable, b: PointTable, at: dict[str, Scalar], name: str) -> Part | None:
    rows_a, rows_b = a.rows_at(at), b.rows_at(at)
    nodes_m, nodes = _averaged(b.amplitude_m[rows_b], b.values[name][rows_b])
    edge_m = SAME * nodes_m[-1]
    inside = [
        row for row in rows_a if nodes_m[0] - edge_m <= a.amplitude_m[row] <= nodes_m[-1] + edge_m
    ]
    if not inside:
        return None
    x_m, values_a = a.amplitude_m[inside], a.values[name][inside]
    sigma = _sigma(a, b, name, (inside, rows_b), nodes_m, nodes)
    curve = Curve(x_m, values_a, np.interp(x_m, nodes_m, nodes), sigma)
    thresholds: tuple[Threshold | None, Threshold | None] = (None, None)
    if name == FORCE:
        thresholds = (
            threshold_of(a.amplitude_m[rows_a], a.values[name][rows_a]),
            threshold_of(nodes_m, nodes),
        )

    def where(index: int) -> dict[str, Scalar]:
        return {**at, AMPLITUDE: float(x_m[index])}

    return Part(at, agreement_of(curve, where), *thresholds, curve)


def _averaged(x: Array, y: Array) -> tuple[Array, Array]:
    """Return rising nodes; values measured several times at one amplitude become their mean."""
    nodes, index = np.unique(x, return_inverse=True)
    counts = np.bincount(index)
    return nodes, np.bincount(index, weights=y) / counts


def _sigma(
    a: PointTable,
    b: PointTable,
    name: str,
    rows: tuple[list[int], list[int]],
    nodes_m: Array,
    nodes: Array,
) -> Array | None:
    """Return the uncertainty of B - A; that of an amplitude counts by the slope of B."""
    x_m = a.amplitude_m[rows[0]]
    terms = []
    for what, factor in ((name, np.ones(len(x_m))), (AMPLITUDE, _slope(x_m, nodes_m, nodes))):
        if what in a.sigmas:
            terms.append(factor * a.sigmas[what][rows[0]])
        if what in b.sigmas:
            at_m, sigma = _averaged(b.amplitude_m[rows[1]], b.sigmas[what][rows[1]])
            terms.append(factor * np.interp(x_m, at_m, sigma))
    return np.sqrt(np.sum(np.square(terms), axis=0)) if terms else None


def _slope(x_m: Array, nodes_m: Array, nodes: Array) -> Array:
    """Return the slope of B at A's amplitudes; not a number if B has one amplitude only."""
    if len(nodes_m) < 2:
        return np.full(len(x_m), np.nan)
    slopes: Array = np.gradient(nodes, nodes_m)
    return np.interp(x_m, nodes_m, slopes)


def _joined(curves: list[Curve]) -> Curve:
    sigmas = [curve.sigma for curve in curves]
    known = [sigma for sigma in sigmas if sigma is not None]
    return Curve(
        np.concatenate([curve.x for curve in curves]),
        np.concatenate([curve.a for curve in curves]),
        np.concatenate([curve.b for curve in curves]),
        np.concatenate(known) if len(known) == len(sigmas) else None,
    )


def _nothing_shared(a: PointTable, b: PointTable) -> Incomparable:
    told = [
        f'{", ".join(f"{each:g}" for each in dict.fromkeys(table.keys[PRELOAD]))} N, '
        f'{1e9 * table.amplitude_m.min():.5g} to {1e9 * table.amplitude_m.max():.5g} nm'
        for table in (a, b)
    ]
    return Incomparable(
        a.side.origin,
        f'({told[0]}) has no point within {b.side.origin} ({told[1]})',
        f'compute its points with: stickslip compare {a.side.origin} model',
    )
