# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The Gymnasium environment: its checker, its numbers, its seeds."""

import re
import runpy
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

from stickslip_ros.errors import StickSlipError
from stickslip_ros.instrument.bench import Bench
from stickslip_ros.instrument.commands import Request
from stickslip_ros.instrument.reports import Status
from stickslip_ros.lab.gym import EPISODE_ACTIONS, STEP_ACTIONS, VOLTAGE_ACTIONS, StickSlipEnv
from stickslip_ros.parameters import Parameters

NAME = 'stickslip_ros.lab.gym:StickSlip-v0'
FREE = Parameters().updated({'load_cell.contact': 'absent'})
SEED = 1234567
WAY_ERROR = 0.03
"""Where the direction changes, a pause of up to a sample lets the undamped runner ring on."""


def episode(env: Any, actions: Any, seed: int) -> Any:
    first, _ = env.reset(seed=seed)
    return np.array([first, *(env.step(action)[0] for action in actions)])


@pytest.mark.parametrize('actions', [VOLTAGE_ACTIONS, STEP_ACTIONS])
def test_the_checker_of_gymnasium_passes(actions: str):
    check_env(gymnasium.make(NAME, actions=actions, render_mode='rgb_array').unwrapped)


def test_steps_are_those_of_a_bench():
    env = StickSlipEnv(actions=STEP_ACTIONS)
    seen = episode(env, [2] * 20 + [1] * 3 + [0] * 5, SEED)
    bench = Bench(env.parameters.updated({'sim.seed': env._bench.parameters.sim.seed}))
    sent = [None] + [1.0] * 20 + [None] * 3 + [-1.0] * 5
    for row, steps in zip(seen, sent, strict=True):
        requests = [Request('steps', (steps,))] if steps else []
        readings = bench.update(bench.time_ns + FREE.block_ns, requests).readings
        np.testing.assert_allclose(row[0], 1e6 * readings.position_m, rtol=1e-6)
        assert row[1] == np.float32(readings.force_n / FREE.stand.preload)
    assert seen[20][0] > 1.0
    assert seen[-1][0] < seen[20][0]


@pytest.mark.parametrize('frequency_hz', [113.767, 200.0, 500.0, 900.0, 1500.0, 2000.0])
@pytest.mark.parametrize('sent', [(100,), (-100,), (7, -3, 1, -1, 40, -5)])
def test_steps_one_by_one_go_as_far_as_all_at_once(frequency_hz: float, sent: tuple[int, ...]):
    stand = FREE.updated({'step.frequency': frequency_hz})
    env, bench = StickSlipEnv(stand, STEP_ACTIONS), Bench(stand)
    env.reset(seed=SEED)
    for steps in sent:
        action = 2 if steps > 0 else 0
        for _ in range(abs(steps)):
            *_, info = env.step(action)
        requests = [Request('steps', (float(steps),))]
        while bench.update(bench.time_ns + stand.sample_ns, requests).status & Status.MOVING:
            requests = []
    assert info['time_s'] == pytest.approx(1e-3 + sum(map(abs, sent)) / frequency_hz, rel=0.01)
    *_, info = env.step(1)
    way_m = bench.update(bench.time_ns + stand.block_ns).readings.truth_position_m
    assert abs(way_m) > 3e-6
    assert info['truth_position_m'] == pytest.approx(way_m, rel=WAY_ERROR, abs=0.0)


def test_a_voltage_is_a_share_of_the_range_and_bounded():
    env = StickSlipEnv(FREE.updated({'amplifier.voltage_max': 150.0}))
    env.reset(seed=SEED)
    for share in (-0.37, 1.0, 7.5):
        for _ in range(3):
            observation, reward, *_, info = env.step(np.array([share]))
        assert observation.dtype == np.float32
        assert observation[2] == pytest.approx(min(share, 1.0), abs=1e-3)
        assert reward == pytest.approx(-abs(observation[3]))
        assert info['error_m'] == pytest.approx(-1e-6 * observation[3])
        assert env.target_m == pytest.approx(1e-6 * (observation[0] + observation[3]))


def test_the_picture_shows_runner_target_and_voltage():
    env = StickSlipEnv(FREE, render_mode='rgb_array')
    env.reset(seed=SEED, options={'target_m': -0.5e-6})
    env.step(np.array([0.0]))
    picture = env.render()
    runner, target = (
        np.flatnonzero((picture[row] == colour).all(axis=1)).mean()
        for row, colour in ((30, (90, 90, 90)), (16, (200, 60, 40)))
    )
    assert (runner - target) / 256 == pytest.approx(0.125 + 0.5 * 0.08 / 4.0, abs=0.02)
    assert (picture[58] == (40, 100, 200)).all(axis=1).sum() == pytest.approx(128, abs=3)
    assert StickSlipEnv(FREE).render() is None


def test_an_integrating_controller_reaches_a_target_within_the_scan_range():
    env = StickSlipEnv()
    observation, _ = env.reset(seed=SEED, options={'target_m': 61.3e-9})
    share = -1.0
    for _ in range(300):
        share += observation[3]
        observation, reward, *_ = env.step(np.array([share]))
    assert reward > -0.002


def test_seeds_decide_noise_and_target():
    env = StickSlipEnv(actions=STEP_ACTIONS)
    first, again, other = (episode(env, [2, 2, 1], seed) for seed in (SEED, SEED, SEED + 1))
    np.testing.assert_array_equal(first, again)
    assert not np.array_equal(first[:, 0], other[:, 0])
    assert first[0].sum() != other[0].sum()


def test_episodes_are_cut_off_and_vector_environments_work():
    envs = gymnasium.make_vec(NAME, num_envs=2, vectorization_mode='sync', actions=STEP_ACTIONS)
    envs.reset(seed=SEED)
    for _ in range(EPISODE_ACTIONS):
        observations, _, ended, cut, _ = envs.step(np.array([1, 2]))
    assert list(cut) == [True, True]
    assert list(ended) == [False, False]
    assert observations[1][0] > observations[0][0] + 50.0


def test_the_example_of_the_documentation_reaches_its_target(capsys: pytest.CaptureFixture[str]):
    page = Path(__file__).parents[2] / 'docs' / 'howto' / 'gym.md'
    [example] = re.findall(r'```python\n(.*?)```', page.read_text(), re.DOTALL)
    exec(compile(example, str(page), 'exec'), {})
    assert abs(float(capsys.readouterr().out.split()[0])) < 100.0


def test_the_example_learns_to_come_to_a_target(capsys: pytest.CaptureFixture[str]):
    example = runpy.run_path(str(Path(__file__).parents[2] / 'docs' / 'examples' / 'learn.py'))
    before_m, after_m = example['main'](generations=6)
    assert before_m > 20e-9
    assert after_m < 5e-9
    assert len(capsys.readouterr().out.splitlines()) == 7


def test_what_it_does_not_know_is_refused():
    with pytest.raises(StickSlipError, match='use voltage or steps'):
        StickSlipEnv(actions='force')
    with pytest.raises(StickSlipError, match='use rgb_array'):
        StickSlipEnv(render_mode='human')
    with pytest.raises(gymnasium.error.ResetNeeded):
        StickSlipEnv().step(np.array([0.5]))
