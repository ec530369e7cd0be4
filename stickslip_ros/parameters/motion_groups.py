"""Parameters of moves: steps, jogging, closed loop, limits."""

from dataclasses import dataclass

from stickslip_ros.errors import OutOfRange
from stickslip_ros.parameters.fields import ASSUMED, Checked, quantity, switch


@dataclass(frozen=True)
class StepParameters(Checked):
    """The saw-tooth of single steps, of jogging and of coarse positioning."""

    amplitude: float = quantity(
        300.0, 'V', 0.001, 2000.0, ASSUMED, 'peak to peak voltage of a step'
    )
    frequency: float = quantity(
        1e3, 'Hz', 0.001, 1e6, ASSUMED, 'steps per second; jogging has its own'
    )


@dataclass(frozen=True)
class JogParameters(Checked):
    """Jogging: steps that go on while somebody asks for them."""

    timeout: float = quantity(
        0.5,
        's',
        0.001,
        60.0,
        ASSUMED,
        'watchdog: time after the last command/jog at which the drive stops',
    )


@dataclass(frozen=True)
class ClosedLoopParameters(Checked):
    """The built-in position control: coarse steps, fine scan, hold."""

    tolerance: float = quantity(
        2e-09, 'm', 1e-12, 0.001, ASSUMED, 'distance from the target that counts as in position'
    )
    settle_time: float = quantity(
        0.01, 's', 0.0, 60.0, ASSUMED, 'time in position after which a move is done'
    )
    timeout: float = quantity(
        30.0, 's', 0.001, 1e5, ASSUMED, 'time after which a move that is not done has failed'
    )
    velocity: float = quantity(
        0.0,
        'm/s',
        0.0,
        1.0,
        ASSUMED,
        'velocity of the way to the target; 0 is as fast as the steps go',
    )
    gain: float = quantity(
        100.0,
        '1/s',
        0.1,
        1e4,
        ASSUMED,
        'integral gain of the fine scan: share of the error taken back per second',
    )
    hold: bool = switch(True, ASSUMED, 'hold the target after a move, until the next one')


@dataclass(frozen=True)
class LimitsParameters(Checked):
    """Where a move is stopped; a direct voltage knows none of these limits."""

    soft_min: float = quantity(
        0.0,
        'm',
        -1.0,
        1.0,
        ASSUMED,
        'lowest position reading of a move; no soft limits where both are 0',
    )
    soft_max: float = quantity(0.0, 'm', -1.0, 1.0, ASSUMED, 'highest position reading of a move')
    following_error: float = quantity(
        0.0, 'm', 0.0, 1.0, ASSUMED, 'largest distance from the set point in closed loop; 0 is any'
    )
    blocked_time: float = quantity(
        0.05,
        's',
        0.001,
        60.0,
        ASSUMED,
        'time without progress in closed loop that counts as an end stop',
    )

    @property
    def has_soft_limits(self) -> bool:
        """Whether a move is stopped at ``soft_min`` and ``soft_max``."""
        return self.soft_min != 0.0 or self.soft_max != 0.0

    def check_together(self) -> None:
        """Refuse soft limits without a way between them."""
        if self.soft_min > self.soft_max:
            limit = f'above limits.soft_max, {self.soft_max:g} m'
            raise OutOfRange('limits.soft_min', self.soft_min, 'm', limit, 'lower it')
