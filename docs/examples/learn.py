"""
A linear policy learns to scan the runner to targets, by the cross-entropy method.

``python docs/examples/learn.py`` prints the mean distance, generation by generation.

"""

import gymnasium
import numpy as np

from stickslip_ros import Parameters

STAND = Parameters().updated(
    {'load_cell.contact': 'absent', 'runner.damping': 5.0, 'amplifier.voltage_initial': 150.0}
)
TARGET_MAX_M = 50e-9
ACTIONS, POPULATION, ELITE = 40, 24, 6
SPREAD_LEAST = 0.02


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
    env = gymnasium.make(
        'stickslip_ros.lab.gym:StickSlip-v0', parameters=STAND, target_max_m=TARGET_MAX_M
    )
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
