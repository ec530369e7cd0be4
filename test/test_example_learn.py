# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The example that learns: its environment passes Gymnasium's checker, and it comes nearer."""

import importlib
import re
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

from stickslip_ros import Bench, Request

pytestmark = pytest.mark.slow

DOCS = Path(__file__).parents[1] / 'docs'
SEED = 1234567
STEPPED = 0.03
"""Between steps the runner rings for a block, so that their lengths differ."""


@pytest.fixture
def learn(monkeypatch: pytest.MonkeyPatch) -> Any:
    monkeypatch.syspath_prepend(str(DOCS / 'examples'))
    return importlib.import_module('learn')


def episode(env: Any, actions: Any, seed: int) -> np.ndarray:
    first, _ = env.reset(seed=seed)
    return np.array([first, *(env.step(action)[0] for action in actions)])


@pytest.mark.parametrize('actions', ['voltage', 'steps'])
def test_the_checker_of_gymnasium_passes(learn: Any, actions: str):
    check_env(gymnasium.make('learn:StickSlip-v0', actions=actions).unwrapped)


def test_seeds_decide_noise_and_target(learn: Any):
    env = learn.StickSlip(actions='steps')
    first, again, other = (episode(env, [2, 2, 1], seed) for seed in (SEED, SEED, SEED + 1))
    assert first.tobytes() == again.tobytes()
    assert not np.array_equal(first[:, 0], other[:, 0])
    assert first[0].sum() != other[0].sum()


def test_a_voltage_is_a_share_of_the_range_and_bounded(learn: Any):
    env = learn.StickSlip(learn.FREE.updated({'amplifier.voltage_max': 150.0}))
    env.reset(seed=SEED)
    for share in (-0.37, 1.0, 7.5):
        for _ in range(3):
            observation, reward, *_, info = env.step(np.array([share]))
        assert observation[2] == pytest.approx(min(share, 1.0), abs=1e-3)
        assert reward == pytest.approx(-abs(observation[3]))
        assert info['error_m'] == pytest.approx(-1e-6 * observation[3])
        assert env.target_m == pytest.approx(1e-6 * (observation[0] + observation[3]))


@pytest.mark.parametrize(('frequency_hz', 'action'), [(113.767, 0), (500.0, 2), (1500.0, 0)])
def test_steps_one_by_one_go_as_far_as_all_at_once(learn: Any, frequency_hz: float, action: int):
    stand = learn.FREE.updated({'step.frequency': frequency_hz, 'runner.damping': 20.0})
    env, bench = learn.StickSlip(stand, 'steps'), Bench(stand)
    env.reset(seed=SEED)
    for _ in range(40):
        *_, info = env.step(action)
    requests = [Request('steps', (40.0 * (action - 1),))]
    for _ in range(round(42e3 / frequency_hz)):
        output = bench.update(bench.time_ns + stand.block_ns, requests)
        requests = []
    way_m = output.readings.truth_position_m
    assert abs(way_m) > 2e-6
    assert info['truth_position_m'] == pytest.approx(way_m, rel=STEPPED, abs=0.0)


def test_episodes_are_cut_off_and_vector_environments_work(learn: Any):
    envs = gymnasium.make_vec('StickSlip-v0', num_envs=2, vectorization_mode='sync')
    envs.reset(seed=SEED)
    for _ in range(1000):
        observations, _, ended, cut, _ = envs.step(np.array([[-1.0], [1.0]]))
    assert list(cut) == [True, True]
    assert list(ended) == [False, False]
    assert observations[1][2] > observations[0][2] + 1.9


def test_mistakes_are_refused(learn: Any):
    with pytest.raises(ValueError, match='use voltage or steps'):
        learn.StickSlip(actions='force')
    with pytest.raises(gymnasium.error.ResetNeeded):
        learn.StickSlip().step(np.array([0.5]))


def test_the_controller_of_the_page_reaches_its_target(learn, capsys):
    page = DOCS / 'howto' / 'gym.md'
    [example] = re.findall(r'```python\n(.*?)```', page.read_text(), re.DOTALL)
    exec(compile(example, str(page), 'exec'), {})
    assert abs(float(capsys.readouterr().out.split()[0])) < 100.0


def test_it_learns_to_come_to_a_target(learn: Any, capsys: pytest.CaptureFixture[str]):
    before_m, after_m = learn.main(generations=6)
    assert before_m > 20e-9
    assert after_m < 5e-9
    assert len(capsys.readouterr().out.splitlines()) == 7
