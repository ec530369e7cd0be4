# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Draws of a fit, or of its file: stands from its distribution of parameters."""

import json
import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from stickslip_ros.arrays import Array
from stickslip_ros.errors import OutOfRange, RecordingError, StickSlipError
from stickslip_ros.files import read_bytes
from stickslip_ros.lab.fitting.free import Coordinate
from stickslip_ros.lab.fitting.natural import Natural
from stickslip_ros.lab.fitting.statistics import UNDETERMINED
from stickslip_ros.parameters import Parameters

_DRAWS = 100  # by default
DRAWS_MAX = 10_000


def drawn(
    natural: Natural, place: Array, covariance: Array, vague: Sequence[str], count: int, seed: int
) -> list[Parameters]:
    """
    Return stands from the normal distribution of natural coordinates.

    The minimum has the shape (free,), the covariance (free, free). Raises OutOfRange for an
    impossible number, or if there are ``vague`` parameters, known to less than a factor of e.

    """
    if not 1 <= count <= DRAWS_MAX:
        limit = f'not from 1 to {DRAWS_MAX}'
        raise OutOfRange('number of draws', count, '', limit, f'take {_DRAWS}')
    for name in vague:
        limit = f'above {UNDETERMINED:g}: the parameter is not determined, and has no draws'
        hint = 'fit a recording under another preload too; fit --plan 5 lists the best'
        raise OutOfRange(f'standard error of ln({name})', '', '', limit, hint)
    chance = np.random.default_rng(seed)
    places = chance.multivariate_normal(place, covariance, count, method='eigh')
    return [natural.stand.updated(natural.settings(each)) for each in places]


def read_stand(path: Path) -> Parameters:
    """Return the fitted stand of a file of ``stickslip fit -o fitted.json``."""
    return _read(path)[0].stand


def read_draws(path: Path, count: int = _DRAWS, seed: int = 1) -> list[Parameters]:
    """
    Return draws of the fit in a file of ``stickslip fit -o fitted.json``.

    Parameters without a finite error stay constant. Raises RecordingError for another file or a
    fit that failed its checks, OutOfRange for an impossible number or a parameter that is known to
    less than a factor of e.

    """
    natural, place, covariance, vague, holds = _read(path)
    if not holds:
        hint = 'free the missing parameters and fit again, or use --params fitted.yaml alone'
        raise RecordingError(path, 'is of a fit that failed its checks', hint)
    return drawn(natural, place, covariance, vague, count, seed)


def read_note(path: Path) -> str:
    """Return the note on bands in the file of a fit."""
    return str(json.loads(path.read_bytes()).get('bands', ''))


def _read(path: Path) -> tuple[Natural, Array, Array, list[str], bool]:
    """Return coordinates, minimum, its covariance, vague parameters, and whether the fit holds."""
    hint = 'give the .json of stickslip fit -o, of this version'
    try:
        content = json.loads(read_bytes(path, hint))
        free = tuple(
            Coordinate(
                each['name'],
                each['unit'],
                each['start'],
                each['lower'],
                math.inf if each['upper'] is None else each['upper'],
            )
            for each in content['estimates']
        )
        vague = [each['name'] for each in content['estimates'] if each['undetermined']]
        stand = Parameters().updated(content['parameters'])
        place = np.array(content['natural_coordinates'], dtype=np.float64)
        covariance = np.array(content['covariance_of_natural_coordinates'], dtype=np.float64)
        holds = bool(content['holds'])
        fits = place.shape == (len(free),) and covariance.shape == (len(free), len(free))
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError) as error:
        raise RecordingError(path, f'is no fit ({type(error).__name__})', hint) from None
    except StickSlipError as error:
        raise RecordingError(path, f'holds no stand: {error}', hint) from None
    if not fits:
        raise RecordingError(path, 'is no fit: its covariance has another shape', hint)
    return Natural(stand, free), place, covariance, vague, holds
