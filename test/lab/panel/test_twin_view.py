# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""What the page is numbers of a twin: its last window, and its estimates with their errors."""

import numpy as np
import pytest

from stickslip_ros.errors import WrongKind
from stickslip_ros.lab.panel.twin_view import TwinView

WINDOW = ['t[s]', 'steps', 'rig[m]', 'twin[m]', 'residual_rms[m]']
FIT = ['t[s]', 'chi_square_per_reading', 'contact.friction', 'contact.friction_sigma']
FIT += ['runner.damping', 'runner.damping_sigma']


def hear_window(view: TwinView, start_ms: int) -> None:
    for at_ms in range(start_ms, start_ms + 200):
        view.take_reading('position', at_ms * 1_000_000, 1e-9 * at_ms)
        view.take_reading('residual', at_ms * 1_000_000, 2e-10)
    view.take_window(WINDOW, [1e-3 * (start_ms + 200), 99.0, 9.8e-8, 9.7e-8, 2e-10])


def test_rig_and_twin_are_those_of_the_last_window():
    view = TwinView()
    for start_ms in (7000, 7200):
        hear_window(view, start_ms)
    numbers, curves = view.picture()
    assert numbers['window']['steps'] == 99.0
    assert numbers['length_s'] == pytest.approx(0.199)
    time_s = 1e-3 * np.arange(200)
    assert curves['twin_twin'].x == pytest.approx(time_s, rel=1e-6, abs=1e-9)
    assert curves['twin_twin'].y == pytest.approx(1e-6 * time_s, rel=1e-6, abs=1e-15)
    assert curves['twin_rig'].y == pytest.approx(1e-6 * time_s + 2e-10, rel=1e-6, abs=1e-15)
    assert curves['twin_residual'].y == pytest.approx(np.full(200, 2e-10), rel=1e-6)
    assert not view.has_news
    view.take_reading('position', 7_400_000_000, 0.0)  # of the window after it
    assert not view.has_news
    view.take_reading('position', 7_350_500_000, 0.0)  # which comes late
    assert view.has_news


def test_estimates_are_shown_as_changes_since_the_first_fit_with_their_errors():
    view = TwinView()
    for time_s, friction in ((10.0, 0.3), (20.0, 0.24)):
        view.take_fit(FIT, [time_s, 1.0, friction, 0.003, 20.0, np.inf])
    numbers, curves = view.picture()
    assert numbers['fits'] == [
        ['contact.friction', '0.24 ± 0.003 '],
        ['runner.damping', '20 N s/m, not determined'],
    ]
    assert (numbers['start_s'], numbers['end_s']) == (10.0, 20.0)
    assert curves['contact.friction'].y == pytest.approx([0.0, -0.2], abs=1e-7)
    assert curves['contact.friction low'].y == pytest.approx([-0.01, -0.21], abs=1e-7)
    assert np.isnan(curves['runner.damping high'].y).all()
    view.take_fit(FIT, [2.0, 1.0, 0.24, 0.003, 20.0, 1.0])  # the rig has begun anew
    numbers, curves = view.picture()
    assert len(curves['contact.friction'].y) == 1


@pytest.mark.parametrize(
    ('labels', 'row'),
    [
        (FIT[1:], [1.0, 0.3, 0.003, 20.0, 1.0]),
        (FIT, [np.nan, 1.0, 0.3, 0.003, 20.0, 1.0]),
        (FIT, [-1.0, 1.0, 0.3, 0.003, 20.0, 1.0]),
        (FIT, [1.0]),
        (['t[s]', *map(str, range(100))], [1.0] * 101),
    ],
)
def test_a_row_without_its_time_or_of_another_size_is_refused_and_blanks_nothing(labels, row):
    view = TwinView()
    hear_window(view, 7000)
    view.take_fit(FIT, [10.0, 1.0, 0.3, 0.003, 20.0, 1.0])
    before, _ = view.picture()
    for take in (view.take_fit, view.take_window):
        with pytest.raises(WrongKind, match=r'a t\[s\] of 0 to 2147483647 s'):
            take(labels, row)
    assert view.picture()[0] == before


def test_readings_without_a_window_are_bounded(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr('stickslip_ros.lab.panel.twin_view._READINGS_KEPT', 100)
    view = TwinView()
    for stamp_ns in range(1000):
        view.take_reading('position', stamp_ns, 1e-9)
    assert list(view._heard['position']) == list(range(900, 1000))
    with pytest.raises(WrongKind, match='not a number below'):
        view.take_reading('position', 1000, np.inf)
