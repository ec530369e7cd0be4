"""The position loop at the far end of a link: readings come late, actions take time."""

import math

from stickslip_ros.instrument.position_loop import Level, LoopSettings, PositionLoop, Steps
from stickslip_ros.parameters import to_nanoseconds


class RemoteLoop:
    """
    Bring a stage to a target by steps and voltages that are sent away.

    Time is that of the readings' stamps, so that the loop behaves alike at any speed. After
    steps it waits until they must be over; voltages are sent with every reading.

    Parameters
    ----------
    settings : LoopSettings
        The stage; ``deadband_m`` is also the distance that counts as in position.
    frequency_hz : float
        Steps per second of the drive.
    response_s : float
        Time from sending a command to seeing its effect come to rest in the readings, s.

    """

    def __init__(self, settings: LoopSettings, frequency_hz: float, response_s: float) -> None:
        self._settings = settings
        self._frequency_hz = frequency_hz
        self._response_s = response_s
        self._loop: PositionLoop | None = None
        self._target_m = math.nan
        self._free_ns = self._last_ns = 0
        self._jumps = False
        self._is_busy = False
        self.error_m = math.nan

    @property
    def in_position(self) -> bool:
        """Whether the last reading was within the dead band of the target, and nothing moves."""
        return not self._is_busy and abs(self.error_m) <= self._settings.deadband_m

    def aim(self, target_m: float) -> None:
        """Go to another target, m."""
        self._target_m = target_m
        self.error_m = math.nan
        if self._loop is not None:
            self._loop.start_anew()

    def update(self, time_ns: int, position_m: float) -> Steps | Level | None:
        """
        Return what to send now, if anything.

        Parameters
        ----------
        time_ns : int
            Stamp of the reading, ns.
        position_m : float
            The reading, m; one that is not a number is waited out.

        """
        self._notice_restart(time_ns)
        self.error_m = self._target_m - position_m
        if math.isnan(self.error_m) or time_ns < self._free_ns:
            return None
        action = self._act(position_m)
        self._is_busy = self._jumps
        if self._jumps:
            steps = action.count if isinstance(action, Steps) else 0
            busy_s = abs(steps) / self._frequency_hz + self._response_s
            self._free_ns = time_ns + to_nanoseconds(busy_s)
        return action

    def _notice_restart(self, time_ns: int) -> None:
        """Begin anew where time goes back: the drive was configured again."""
        if time_ns < self._last_ns:
            self._loop, self._free_ns = None, 0
        self._last_ns = time_ns

    def _act(self, position_m: float) -> Steps | Level:
        """Decide; the first decision is to take the piezo to its middle, wherever it is."""
        if self._loop is None:
            self._loop = PositionLoop(self._settings, self._settings.voltage_min_v)
            self._jumps = True
            return self._loop.centre()
        action = self._loop.update(self._target_m, position_m)
        self._jumps = self._loop.is_coarse
        return action
