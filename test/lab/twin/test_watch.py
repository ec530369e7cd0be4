# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""A watch of estimates keeps its rate of false alarms, and names what has changed."""

import numpy as np
import pytest

from stickslip_ros.lab.twin.watch import ELSE, LookEstimate, Watch

PERIOD_S, LOOKS = 10.0, 500
COVARIANCE = np.array([[4.0, 1.5, 0.3], [1.5, 9.0, -0.6], [0.3, -0.6, 0.25]]) * 1e-4


def alarms(seed: int, shared: float, understated: float, memory: float, per_day: float) -> int:
    """Count alarms that begin among looks at a rig that does not change."""
    rng = np.random.default_rng(seed)
    root = understated * np.linalg.cholesky(COVARIANCE)
    watch, count, before = Watch(PERIOD_S, per_day), 0, None
    common, own = rng.normal(size=3), rng.normal(size=3)
    for _ in range(LOOKS):
        own = memory * own + np.sqrt(1.0 - memory**2) * rng.normal(size=3)
        place = root @ (np.sqrt(shared) * common + np.sqrt(1.0 - shared) * own)
        found = watch.changed(LookEstimate(place, COVARIANCE))
        count += found is not None and before is None
        before = found
    return count


@pytest.mark.parametrize(
    ('shared', 'understated', 'memory'),
    [(0.0, 1.0, 0.0), (0.8, 1.0, 0.0), (0.0, 1.0, 0.95), (0.0, 2.0, 0.0), (0.0, 20.0, 0.0)],
    ids=['independent', 'shared', 'correlated', 'understated by 2', 'understated by 20'],
)
def test_nothing_raises_no_more_alarms_than_are_allowed(shared, understated, memory):
    per_day = 50.0  # so that some may come in so few looks
    total = sum(alarms(seed, shared, understated, memory, per_day) for seed in range(10))
    allowed = per_day * 10 * LOOKS * PERIOD_S / 86400.0
    assert total <= allowed + 3.0 * np.sqrt(allowed)


@pytest.mark.parametrize('which', [0, 1, 2])
def test_the_parameter_that_changes_is_named_at_the_second_look(which: int):
    rng, root = np.random.default_rng(which), np.linalg.cholesky(COVARIANCE)
    watch = Watch(PERIOD_S, 1.0)
    for _ in range(6):
        assert watch.changed(LookEstimate(root @ rng.normal(size=3), COVARIANCE)) is None
    step = np.zeros(3)
    step[which] = 10.0 * np.sqrt(COVARIANCE[which, which])
    found = [
        watch.changed(LookEstimate(step + root @ rng.normal(size=3), COVARIANCE)) for _ in range(2)
    ]
    assert found == [None, which]


@pytest.mark.parametrize(
    ('errors', 'told'),
    [
        ([12.0, -12.0, 0.0], ELSE),
        ([-7.0, 100.0, 5.0], 1),  # others are fitted a little off
    ],
)
def test_a_large_change_is_named_and_that_of_no_single_parameter_is_something_else(errors, told):
    watch = Watch(PERIOD_S, 1.0)
    for _ in range(3):
        watch.changed(LookEstimate(np.zeros(3), COVARIANCE))
    step = np.sqrt(np.diag(COVARIANCE)) * np.array(errors)
    found = [watch.changed(LookEstimate(step, COVARIANCE)) for _ in range(2)]
    assert found == [None, told]


def test_one_look_that_is_off_raises_nothing():
    watch = Watch(PERIOD_S, 1.0)
    for place in (0.0, 0.0, 0.0, 1.0, 0.0, 0.0):
        assert watch.changed(LookEstimate(np.full(3, place), COVARIANCE)) is None


def test_a_quiet_look_is_counted_and_a_suspect_one_leaves_the_limit_as_wide_as_it_was():
    watch = Watch(PERIOD_S, 1.0)
    for _ in range(3):
        watch.changed(LookEstimate(np.zeros(3), COVARIANCE))
    limits, step = [watch.limit(3)], np.array([0.0, 1.0, 0.0])
    for place in (0.0 * step, step, 0.0 * step, step):  # a step is fifty errors
        assert watch.changed(LookEstimate(place, COVARIANCE)) is None
        limits.append(watch.limit(3))
    assert limits[0] > limits[1] == limits[2] > limits[3] == limits[4]
    wide = watch.scores(LookEstimate(step, COVARIANCE))[0]
    assert watch.changed(LookEstimate(step, COVARIANCE)) == 1
    np.testing.assert_array_equal(watch.scores(LookEstimate(step, COVARIANCE))[0], wide)


def test_quiet_looks_that_scatter_more_than_is_stated_lower_the_scores():
    scores = []
    for scatter in (1.0, 4.0):
        rng, root = np.random.default_rng(1), scatter * np.linalg.cholesky(COVARIANCE)
        watch = Watch(PERIOD_S, 1.0)
        for _ in range(20):
            watch.changed(LookEstimate(root @ rng.normal(size=3), COVARIANCE))
        scores.append(watch.scores(LookEstimate(np.full(3, 1.0), COVARIANCE))[0].max())
    assert scores[1] < 0.2 * scores[0]
