"""
The drive as a Gymnasium environment, and a linear policy that learns to scan to targets in it.

``python docs/examples/learn.py`` prints the mean distance, generation by generation. In this
folder ``gymnasium.make('learn:StickSlip-v0')`` makes the environment.

"""

import math

import gymnasium
import numpy as np
from gymnasium.spaces import Box, Discrete

from stickslip_ros import Bench, Parameters, Request

FREE = Parameters().updated({'load_cell.contact': 'absent'})
LARGEST = 1e4
"""Bound of an observation; a runner that goes far away stays at it."""
STAND = FREE.updated({'runner.damping': 5.0, 'amplifier.voltage_initial': 150.0})
TARGET_MAX_M = 50e-9
ACTIONS, POPULATION, ELITE = 40, 24, 6
SPREAD_LEAST = 0.02


class StickSlip(gymnasium.Env):
    """One drive, stepped block by block (1 ms); docs/howto/gym.md describes it."""

    def __init__(self, parameters=FREE, actions='voltage', target_max_m=1e-6):
        """Take a stand, ``voltage`` or ``steps``, and the largest target, m."""
        if actions not in ('voltage', 'steps'):
            raise ValueError(f'actions {actions!r} are not known: use voltage or steps')
        self.parameters, self.target_max_m = parameters, target_max_m
        amplifier = parameters.amplifier
        self.low_v, self.high_v = amplifier.voltage_min, amplifier.voltage_max
        # A step, and a block in which it ends: a command that came sooner would replace it.
        step_blocks = 1 + math.ceil(1e9 / parameters.step.frequency / parameters.block_ns)
        self.blocks = step_blocks if actions == 'steps' else 1
        self.observation_space = Box(-LARGEST, LARGEST, (4,), np.float32)
        self.action_space = Discrete(3) if actions == 'steps' else Box(-1.0, 1.0, (1,), np.float32)
        self.bench, self.target_m = None, 0.0

    def reset(self, *, seed=None, options=None):
        """Begin with a drive at rest; ``options={'target_m': ...}`` gives its target, m."""
        super().reset(seed=seed)
        changes = {'sim.seed': int(self.np_random.integers(1 << 31))}
        target_m = self.np_random.uniform(-self.target_max_m, self.target_max_m)
        self.target_m = float((options or {}).get('target_m', target_m))
        self.bench = Bench(self.parameters.updated(changes))
        return self.observe(self.bench.update(self.parameters.block_ns))

    def step(self, action):
        """Carry out an action; the reward is minus the distance, per largest target."""
        if self.bench is None:
            raise gymnasium.error.ResetNeeded('call reset first')
        if isinstance(self.action_space, Discrete):
            requests = [Request('steps', (float(action - 1),))]
        else:
            share = 0.5 + 0.5 * float(np.clip(action, -1.0, 1.0).item())
            voltage_v = self.low_v + share * (self.high_v - self.low_v)
            requests = [Request('voltage', (voltage_v,))]
        for _ in range(self.blocks):
            output = self.bench.update(self.bench.time_ns + self.parameters.block_ns, requests)
            requests = []
        observation, info = self.observe(output)
        return observation, -abs(info['error_m']) / self.target_max_m, False, False, info

    def observe(self, output):
        """Return position and force reading, voltage, and distance, each of about 1."""
        readings = output.readings
        error_m = readings.position_m - self.target_m
        share = (readings.voltage_v - self.low_v) / (self.high_v - self.low_v)
        seen = [
            readings.position_m / self.target_max_m,
            readings.force_n / self.parameters.stand.preload,
            2.0 * share - 1.0,
            -error_m / self.target_max_m,
        ]
        info = {
            'time_s': 1e-9 * readings.time_ns,
            'error_m': error_m,
            'truth_position_m': readings.truth_position_m,
            'status': int(output.status),
        }
        return np.clip(seen, -LARGEST, LARGEST).astype(np.float32), info


gymnasium.register(
    'StickSlip-v0',
    entry_point=StickSlip,  # type: ignore[arg-type]  # is asked to take anything
    max_episode_steps=1000,
)


def distance_m(env, weights, seed):
    """Return the mean distance from the target over the second half of an episode, m."""
    observation, _ = env.reset(seed=seed)
    errors_m = []
    for _ in range(ACTIONS):
        action = weights[:4] @ observation + weights[4]
        observation, *_, info = env.step(np.array([np.clip(action, -1.0, 1.0)], np.float32))
        errors_m.append(abs(info['error_m']))
    return float(np.mean(errors_m[ACTIONS // 2 :]))


def main(generations=15):
    """Learn; return the mean distance before and after, over targets that were not learned."""
    env = gymnasium.make('StickSlip-v0', parameters=STAND, target_max_m=TARGET_MAX_M)
    random = np.random.default_rng(1)
    mean, spread = np.zeros(5), np.ones(5)

    def judged_m():
        return float(np.mean([distance_m(env, mean, seed) for seed in range(1000, 1010)]))

    before_m = judged_m()
    for generation in range(generations):
        tried = mean + spread * random.standard_normal((POPULATION, 5))
        seeds = [3 * generation + each for each in range(3)]
        scores_m = [np.mean([distance_m(env, each, seed) for seed in seeds]) for each in tried]
        best = tried[np.argsort(scores_m)[:ELITE]]
        mean, spread = best.mean(axis=0), best.std(axis=0) + SPREAD_LEAST
        print(f'generation {generation}: {1e9 * np.mean(scores_m):.1f} nm')
    after_m = judged_m()
    print(f'targets not learned: {1e9 * before_m:.1f} nm before, {1e9 * after_m:.1f} nm after')
    return before_m, after_m


if __name__ == '__main__':
    main()
