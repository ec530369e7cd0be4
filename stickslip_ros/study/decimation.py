"""Fewer points for a picture, such that no peak is lost: lowest and highest of each pixel."""

import itertools

import numpy as np

from stickslip_ros.contact.profile import Array


def decimated(x: Array, y: Array, pixels: int) -> tuple[Array, Array]:
    """
    Return the samples that a curve of so many pixels needs.

    Parameters
    ----------
    x : array, shape (n,)
        Rising.
    y : array, shape (n,)
        May hold what is not a number; such samples stay, as gaps.
    pixels : int
        Width of the picture.

    Returns
    -------
    x, y : array, shape (m,)
        All samples if there are at most four per pixel; else first, lowest, highest and last of
        each pixel, in their order.

    """
    if len(x) <= 4 * pixels:
        return x, y
    width = (x[-1] - x[0]) / pixels
    edges = np.searchsorted(x, x[0] + width * np.arange(pixels), 'left')
    starts = np.unique(np.append(edges, len(x)))
    kept = [
        index
        for first, last in itertools.pairwise(starts)
        for index in _extremes(y[first:last], int(first))
    ]
    return x[kept], y[kept]


def _extremes(values: Array, first: int) -> list[int]:
    finite = np.flatnonzero(np.isfinite(values))
    chosen = {0, len(values) - 1}
    if len(finite):
        chosen |= {int(finite[values[finite].argmin()]), int(finite[values[finite].argmax()])}
    if len(finite) < len(values):
        chosen.add(int(np.flatnonzero(~np.isfinite(values))[0]))
    return sorted(first + index for index in chosen)
