# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The twin in the panel: its last window, and the history of its estimates."""

import math
from collections import deque
from collections.abc import Sequence
from typing import Any

import numpy as np

from stickslip_ros.arrays import Array
from stickslip_ros.errors import WrongKind
from stickslip_ros.interface.requests import INT32_MAX
from stickslip_ros.lab.panel.curves import DRAWN_MAX, PanelCurve, curve_of, thinned_curves
from stickslip_ros.parameters import specs
from stickslip_ros.units import NS_PER_S

_FITS_KEPT = 360  # fits shown: one hour at one each 10 s
_READINGS_KEPT = 10_000  # of a topic: five of the longest windows
_COLUMNS_MAX = 100  # of a row
_ERROR = '_sigma'  # suffix of the column with the standard error


def _named(key: str, labels: Sequence[str], row: Sequence[float]) -> dict[str, float]:
    """Return a row by its labels; refuse a row without a time, or a page full of columns."""
    named = dict(zip(labels, row, strict=False))
    is_row = len(labels) == len(row) <= _COLUMNS_MAX
    if not (is_row and 0.0 <= named.get('t[s]', math.nan) <= INT32_MAX):
        wanted = f'a row of at most {_COLUMNS_MAX} columns with a t[s] of 0 to {INT32_MAX} s'
        raise WrongKind(f'twin/{key}', ','.join(labels), wanted, 'send that of a twin')
    return named


class TwinView:
    """Position, residual and estimates of a twin; ``has_news`` if the picture has changed."""

    def __init__(self) -> None:
        self.has_news = True
        self._heard: dict[str, dict[int, float]] = {'position': {}, 'residual': {}}
        self._window: dict[str, float] = {}
        self._end_ns = 0
        self._fits: deque[dict[str, float]] = deque(maxlen=_FITS_KEPT)

    def take_reading(self, name: str, stamp_ns: int, value_m: float) -> None:
        """Take a message of twin/position or twin/residual; keep the newest."""
        if not abs(value_m) < DRAWN_MAX:
            raise WrongKind(f'twin/{name}', value_m, f'a number below {DRAWN_MAX:g}', 'send one')
        self._heard[name][stamp_ns] = value_m
        if len(self._heard[name]) > _READINGS_KEPT:
            del self._heard[name][next(iter(self._heard[name]))]
        self.has_news |= stamp_ns < self._end_ns  # the current window is shown when it ends

    def take_window(self, labels: Sequence[str], row: Sequence[float]) -> None:
        """Take a row of twin/steps; its window starts at the end of the last window."""
        named = _named('steps', labels, row)
        window = {k.partition('[')[0]: v for k, v in named.items() if math.isfinite(v)}
        begin_ns, self._window = self._end_ns, window
        self._end_ns = round(window['t'] * NS_PER_S)
        for values in self._heard.values():  # topics arrive in any order
            for stamp_ns in [x for x in values if x < begin_ns or x > self._end_ns + NS_PER_S]:
                del values[stamp_ns]
        self.has_news = True

    def take_fit(self, labels: Sequence[str], row: Sequence[float]) -> None:
        """Take a row of twin/parameters; clear the history if time or parameters changed."""
        fit = _named('parameters', labels, row)
        last = self._fits[-1] if self._fits else fit
        if fit.keys() != last.keys() or fit['t[s]'] < last['t[s]']:
            self._fits.clear()
        self._fits.append(fit)
        self.has_news = True

    @np.errstate(over='ignore', invalid='ignore')
    def picture(self) -> tuple[dict[str, Any], dict[str, PanelCurve]]:
        """Return numbers and curves for the page; changes are relative to the first fit."""
        self.has_news = False
        numbers: dict[str, Any] = {'window': self._window, 'fits': []}
        window = self.columns()
        shown = {f'twin_{name[:-2]}': (each, 0.0) for name, each in window.items()}
        curves = thinned_curves(shown.pop('twin_time')[0], shown) if window else {}
        numbers['length_s'] = max((float(each.x[-1]) for each in curves.values()), default=0.0)
        if not self._fits:
            return numbers, curves
        time_s = np.array([each['t[s]'] for each in self._fits])
        numbers['start_s'], numbers['end_s'] = float(time_s[0]), float(time_s[-1])
        for name in (each for each in self._fits[-1] if f'{each}{_ERROR}' in self._fits[-1]):
            text, shares = self._estimate(name)
            numbers['fits'].append([name, text])
            for end, share in shares.items():
                curves[f'{name}{end}'] = curve_of(time_s - time_s[0], share, 0.0)
        return numbers, curves

    def _estimate(self, name: str) -> tuple[str, dict[str, Array]]:
        """Return the newest estimate in words, and its changes with both ends of the error."""
        columns = name, f'{name}{_ERROR}'
        value, error = (np.array([each[key] for each in self._fits]) for key in columns)
        unit = specs()[name].unit if name in specs() else ''
        text = f'{value[-1]:.4g} ± {error[-1]:.2g} {unit}' if math.isfinite(error[-1]) else ''
        error = np.where(np.isfinite(error), error, np.nan)
        ends, scale = {'': 0.0, ' low': -error, ' high': error}, abs(value[0]) or math.nan
        shares = {end: (value + off - value[0]) / scale for end, off in ends.items()}
        return text or f'{value[-1]:.4g} {unit}, not determined', shares

    def columns(self) -> dict[str, Array]:
        """Return time, s, and readings, m, of the window."""
        twin, residual = self._heard.values()
        both = sorted(x for x in twin.keys() & residual.keys() if x < self._end_ns)
        if not both:
            return {}
        time_s = np.array([each - both[0] for each in both]) / NS_PER_S
        twin_m, left_m = (np.array([each[at] for at in both]) for each in (twin, residual))
        way_m = twin_m - twin_m[0]
        return {'time_s': time_s, 'rig_m': way_m + left_m, 'twin_m': way_m, 'residual_m': left_m}
