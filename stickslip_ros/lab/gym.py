# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The drive as a Gymnasium environment: a controller learns to move the runner to a target.

``gymnasium.make('stickslip_ros.lab.gym:StickSlip-v0')`` makes it; docs/howto/gym.md describes it.

"""

from typing import Any

import gymnasium
import numpy as np
from numpy.typing import NDArray

from stickslip_ros.errors import OutOfRange
from stickslip_ros.instrument.bench import Bench
from stickslip_ros.instrument.commands import Request
from stickslip_ros.instrument.reports import Output
from stickslip_ros.parameters import Parameters, to_nanoseconds
from stickslip_ros.units import NANO

VOLTAGE_ACTIONS, STEP_ACTIONS = 'voltage', 'steps'
EPISODE_ACTIONS = 1000
SEEDS = 1 << 31
_LARGEST = 1e4
"""Bound of a normalised observation, which is about 1; a runner that goes far away stays at it."""
RGB_ARRAY = 'rgb_array'
_HEIGHT, _WIDTH, _VIEW = 64, 256, 2.0
"""Pixels of a picture, and what its half shows, in largest targets."""
_STAGE, _RUNNER, _TARGET, _BAR = (235, 235, 235), (90, 90, 90), (200, 60, 40), (40, 100, 200)

Observation = NDArray[np.float32]


class StickSlipEnv(gymnasium.Env[Observation, Any]):
    """
    One drive; every action lasts the same simulated time.

    The observation is what the sensors read at its end, each about 1 at most: position (per
    largest target), force (per preload), voltage (-1 to 1, the range of the amplifier), and
    target minus position (per largest target). The reward is minus the size of the last one. An
    episode does not end by itself; ``gymnasium.make`` cuts it off after 1000 actions.

    Parameters
    ----------
    parameters : Parameters, optional
        The stand; by default that of the paper without a load cell. ``sim.seed`` is drawn anew
        for every episode.
    actions : str
        ``voltage``: a number from -1 to 1, the range of the amplifier, for one block (by default
        1 ms); ``steps``: 0, 1 or 2, a step backwards, none, or a step forwards, for
        the time of a step. Steps in one direction follow each other without a pause.
    target_max_m : float
        Targets are drawn from minus to plus this, m.
    render_mode : str, optional
        ``rgb_array``: ``render`` returns a picture of runner, target and voltage.

    Raises
    ------
    OutOfRange
        If the kind of actions or of pictures is not known.

    """

    metadata: dict[str, Any] = {  # noqa: RUF012 - as Gymnasium declares it
        'render_modes': [RGB_ARRAY],
        'render_fps': 50,
    }

    def __init__(
        self,
        parameters: Parameters | None = None,
        actions: str = VOLTAGE_ACTIONS,
        target_max_m: float = 1e-6,
        render_mode: str | None = None,
    ) -> None:
        limit = 'not one of the kinds'
        if actions not in (VOLTAGE_ACTIONS, STEP_ACTIONS):
            raise OutOfRange(
                'actions', actions, '', limit, f'use {VOLTAGE_ACTIONS} or {STEP_ACTIONS}'
            )
        if render_mode not in (None, RGB_ARRAY):
            raise OutOfRange('render_mode', render_mode, '', limit, f'use {RGB_ARRAY}')
        self.render_mode = render_mode
        free = Parameters().updated({'load_cell.contact': 'absent'})
        self.parameters = free if parameters is None else parameters
        self.target_m = 0.0
        self._target_max_m = target_max_m
        amplifier = self.parameters.amplifier
        self._zero_v = amplifier.voltage_min
        self._range_v = amplifier.voltage_max - amplifier.voltage_min
        self._seen: Observation = np.zeros(4, np.float32)
        self.observation_space = gymnasium.spaces.Box(-_LARGEST, _LARGEST, (4,), np.float32)
        self.action_space: gymnasium.Space[Any] = (
            gymnasium.spaces.Box(-1.0, 1.0, (1,), np.float32)
            if actions == VOLTAGE_ACTIONS
            else gymnasium.spaces.Discrete(3)
        )
        self._bench: Bench | None = None

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """
        Begin an episode with a drive at rest; ``options={'target_m': …}`` gives its target, m.

        The same seed gives the same noise and the same target.

        """
        super().reset(seed=seed)
        drawn = int(self.np_random.integers(SEEDS))
        target_m = self.np_random.uniform(-self._target_max_m, self._target_max_m)
        self.target_m = float((options or {}).get('target_m', target_m))
        self._bench = Bench(self.parameters.updated({'sim.seed': drawn}))
        return self._observe(self._bench.update(self.parameters.block_ns))

    def step(self, action: Any) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """Carry out an action."""
        if self._bench is None:
            raise gymnasium.error.ResetNeeded('call reset first')
        if isinstance(self.action_space, gymnasium.spaces.Box):
            share = 0.5 + 0.5 * min(max(float(np.asarray(action).item()), -1.0), 1.0)
            request = Request('voltage', (self._zero_v + share * self._range_v,))
            output = self._bench.update(self._bench.time_ns + self.parameters.block_ns, [request])
        else:
            output = self._step(self._bench, int(action) - 1)
        observation, info = self._observe(output)
        return observation, -abs(info['error_m']) / self._target_max_m, False, False, info

    def render(self) -> NDArray[np.uint8] | None:
        """Return a picture, shape (64, 256, 3), if ``render_mode`` asks for one."""
        if self.render_mode is None:
            return None
        position, _, voltage, error = self._seen
        picture: NDArray[np.uint8] = np.full((_HEIGHT, _WIDTH, 3), 255, np.uint8)

        def fill(low: float, high: float, rows: slice, colour: tuple[int, int, int]) -> None:
            ends = (
                np.clip(np.array([low, high]) / _VIEW, -1.0, 1.0) * (_WIDTH - 1) // 2 + _WIDTH // 2
            )
            picture[rows, int(ends[0]) : int(ends[1]) + 1] = colour

        fill(-_VIEW, _VIEW, slice(40, 48), _STAGE)
        fill(position - 0.3, position + 0.3, slice(24, 40), _RUNNER)
        fill(position + error, position + error, slice(12, 48), _TARGET)
        fill(-_VIEW, _VIEW * voltage, slice(56, 62), _BAR)
        return picture

    def _step(self, bench: Bench, direction: int) -> Output:
        """Make a step, or rest as long, to its last sample: the next step joins its end."""
        sample_ns, block_ns = self.parameters.sample_ns, self.parameters.block_ns
        period_ns = to_nanoseconds(1.0 / self.parameters.step.frequency)
        wave = bench.motion.wave
        runs = bench.motion.is_running and bench.stand.cycle < wave.cycles
        requests = list[Request]()
        if runs and direction * wave.rise_v > 0.0:
            bench.motion.wave = wave._replace(cycles=wave.cycles + 1)
            period_ns += to_nanoseconds(wave.period_s - bench.stand.ramp_s)
        elif direction:
            if runs:
                bench.update(bench.time_ns + sample_ns)
            requests = [Request('steps', (float(direction),))]
        until_ns = bench.time_ns + max(period_ns // sample_ns, 1) * sample_ns
        while bench.time_ns < until_ns:
            output = bench.update(min(bench.time_ns + block_ns, until_ns), requests)
            requests = []
        return output

    def _observe(self, output: Output) -> tuple[Observation, dict[str, Any]]:
        readings = output.readings
        share = (readings.voltage_v - self._zero_v) / self._range_v
        error_m = readings.position_m - self.target_m
        info = {
            'time_s': readings.time_ns * NANO,
            'error_m': error_m,
            'truth_position_m': readings.truth_position_m,
            'status': int(output.status),
        }
        position, error = readings.position_m / self._target_max_m, -error_m / self._target_max_m
        force = readings.force_n / self.parameters.stand.preload
        seen = np.clip([position, force, 2.0 * share - 1.0, error], -_LARGEST, _LARGEST)
        self._seen = seen.astype(np.float32)
        return self._seen.copy(), info


gymnasium.register(
    'StickSlip-v0',
    entry_point=f'{__name__}:{StickSlipEnv.__name__}',
    max_episode_steps=EPISODE_ACTIONS,
)
