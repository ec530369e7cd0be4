# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Draws of a fit, or of its file: stands from its distribution of parameters."""

import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from stickslip_ros.arrays import Array
from stickslip_ros.errors import OutOfRange, RecordingError, StickSlipError
from stickslip_ros.files import read_bytes
from stickslip_ros.lab.fitting.free import Coordinate
from stickslip_ros.lab.fitting.statistics import UNDETERMINED, vague
from stickslip_ros.parameters import Parameters

_DRAWS = 100  # by default
DRAWS_MAX = 10_000


def drawn(
    stand: Parameters,
    free: Sequence[Coordinate],
    place: Array,
    covariance: Array,
    count: int,
    seed: int,
) -> list[Parameters]:
    """
    Return stands from the normal distribution of coordinates.

    The minimum has the shape (free,), the covariance (free, free); coordinates without a variance
    stay constant. Raises OutOfRange for an impossible number, or if a parameter is known to less
    than a factor of e.

    """
    if not 1 <= count <= DRAWS_MAX:
        limit = f'not from 1 to {DRAWS_MAX}'
        raise OutOfRange('number of draws', count, '', limit, f'take {_DRAWS}')
    known = np.isfinite(np.diag(covariance))
    for one, error, is_vague in zip(
        free, np.sqrt(np.diag(covariance)), vague(covariance), strict=True
    ):
        if is_vague:
            what = f'standard error of ln({one.name})' if one.is_log else f'error of {one.name}'
            limit = f'above {UNDETERMINED:g}: the parameter is not determined, and has no draws'
            hint = 'fit a recording under another preload too; fit --plan 5 lists the best'
            raise OutOfRange(what, float(error), '', limit, hint)
    chance = np.random.default_rng(seed)
    places = np.tile(place, (count, 1))
    if known.any():
        within = covariance[np.ix_(known, known)]
        places[:, known] = chance.multivariate_normal(place[known], within, count, method='eigh')
    names = [one.name for one in free]
    stands = []
    for each in places.tolist():
        values = [one.to_value(z) for one, z in zip(free, each, strict=True)]
        stands.append(stand.updated(dict(zip(names, values, strict=True))))
    return stands


def read_stand(path: Path) -> Parameters:
    """Return the fitted stand of a file of ``stickslip fit -o fitted.json``."""
    return _read(path)[0]


def read_draws(path: Path, count: int = _DRAWS, seed: int = 1) -> list[Parameters]:
    """
    Return draws of the fit in a file of ``stickslip fit -o fitted.json``.

    Parameters without a finite error stay constant. Raises RecordingError for another file or a
    fit that failed its checks, OutOfRange for an impossible number or a parameter that is known to
    less than a factor of e.

    """
    stand, free, place, covariance, holds = _read(path)
    if not holds:
        hint = 'free the missing parameters and fit again, or use --params fitted.yaml alone'
        raise RecordingError(path, 'is of a fit that failed its checks', hint)
    return drawn(stand, free, place, covariance, count, seed)


def read_note(path: Path) -> str:
    """Return the note on bands in the file of a fit."""
    return str(json.loads(path.read_bytes()).get('bands', ''))


def _read(path: Path) -> tuple[Parameters, list[Coordinate], Array, Array, bool]:
    """Return stand, free parameters, minimum, its covariance, and whether the fit holds."""
    hint = 'give the .json of stickslip fit -o'
    try:
        content = json.loads(read_bytes(path, hint))
        free = [
            Coordinate(each['name'], each['unit'], each['start'], each['lower'], each['upper'])
            for each in content['estimates']
        ]
        stand = Parameters().updated(content['parameters'])
        place = np.array(content['coordinates'], dtype=np.float64)
        rows = content['covariance_of_coordinates']
        covariance = np.array(
            [[np.nan if each is None else each for each in row] for row in rows], dtype=np.float64
        )
        holds = bool(content['holds'])
        fits = place.shape == (len(free),) and covariance.shape == (len(free), len(free))
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError) as error:
        raise RecordingError(path, f'is no fit ({type(error).__name__})', hint) from None
    except StickSlipError as error:
        raise RecordingError(path, f'holds no stand: {error}', hint) from None
    if not fits:
        raise RecordingError(path, 'is no fit: its covariance has another shape', hint)
    return stand, free, place, covariance, holds
