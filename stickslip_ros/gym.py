"""
The drive as a Gymnasium environment: a controller learns to move the runner to a target.

``gymnasium.make('stickslip_ros.gym:StickSlip-v0')`` makes it; docs/howto/gym.md describes it.

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
from stickslip_ros.units import MICRO, NANO

VOLTAGE, STEPS = 'voltage', 'steps'
EPISODE_ACTIONS = 1000
SEEDS = 1 << 31
LARGEST = np.array([1e6, 1e3, 2.0, 1e6])
"""Bounds of an observation: 1 m, 1 kN, twice the range of the amplifier; none comes near them."""

Observation = NDArray[np.float64]


class StickSlipEnv(gymnasium.Env[Observation, Any]):
    """
    One drive; every action lasts the same simulated time.

    The observation is what the sensors read at its end: position (um), force (N),
    voltage (share of the range of the amplifier) and target (um). The reward is minus the
    distance of the position reading from the target, in um. An episode does not end by itself;
    ``gymnasium.make`` cuts it off after 1000 actions.

    Parameters
    ----------
    parameters : Parameters, optional
        The stand; by default that of the paper without a load cell. ``sim.seed`` is drawn anew
        for every episode.
    actions : str
        ``voltage``: a number from 0 to 1, the share of the range of the amplifier, for one block
        (by default 1 ms); ``steps``: 0, 1 or 2, a step backwards, none, or a step forwards, for
        the time of a step. Steps in one direction follow each other without a pause.
    target_max_m : float
        Targets are drawn from minus to plus this, m.

    Raises
    ------
    OutOfRange
        If the kind of actions is not known.

    """

    metadata: dict[str, Any] = {'render_modes': []}  # noqa: RUF012 - as Gymnasium declares it

    def __init__(
        self,
        parameters: Parameters | None = None,
        actions: str = VOLTAGE,
        target_max_m: float = 1e-6,
    ) -> None:
        if actions not in (VOLTAGE, STEPS):
            limit = 'not one of the kinds'
            raise OutOfRange('actions', actions, '', limit, f'use {VOLTAGE} or {STEPS}')
        free = Parameters().updated({'load_cell.contact': 'absent'})
        self.parameters = free if parameters is None else parameters
        self.target_m = 0.0
        self._target_max_m = target_max_m
        amplifier = self.parameters.amplifier
        self._zero_v = amplifier.voltage_min
        self._range_v = amplifier.voltage_max - amplifier.voltage_min
        self.observation_space = gymnasium.spaces.Box(-LARGEST, LARGEST, dtype=np.float64)
        self.action_space: gymnasium.Space[Any] = (
            gymnasium.spaces.Box(0.0, 1.0, (1,), np.float64)
            if actions == VOLTAGE
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
            share = min(max(float(np.asarray(action).item()), 0.0), 1.0)
            request = Request('voltage', (self._zero_v + share * self._range_v,))
            output = self._bench.update(self._bench.time_ns + self.parameters.block_ns, [request])
        else:
            output = self._step(self._bench, int(action) - 1)
        observation, info = self._observe(output)
        return observation, -abs(info['error_m']) / MICRO, False, False, info

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
        position_um, target_um = readings.position_m / MICRO, self.target_m / MICRO
        info = {
            'time_s': readings.time_ns * NANO,
            'error_m': readings.position_m - self.target_m,
            'truth_position_m': readings.truth_position_m,
            'status': int(output.status),
        }
        return np.array([position_um, readings.force_n, share, target_um]), info


gymnasium.register(
    'StickSlip-v0',
    entry_point=f'{__name__}:{StickSlipEnv.__name__}',
    max_episode_steps=EPISODE_ACTIONS,
)
