"""What an operator may ask of the drive: requests as they come, commands once checked."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from stickslip_ros.drive.records import Wave
from stickslip_ros.parameters import FaultParameters, Parameters, Scalar


@dataclass(frozen=True)
class Request:
    """
    What somebody asked for, not yet checked.

    Attributes
    ----------
    name : str
        ``fault``, or one of ``checks.CHECKS``.
    values : sequence of float
        Its numbers, in the order of the topic; rows of a waveform one after another. An
        ``array.array`` where there may be many.
    settings : tuple of (str, value)
        Of ``fault``: full names of parameters ``fault.*`` and their new values.

    """

    name: str
    values: Sequence[float] = ()
    settings: tuple[tuple[str, Scalar], ...] = ()


@dataclass(frozen=True)
class Move:
    """
    A checked request for the piezo: the wave that it shall follow.

    Attributes
    ----------
    name : str
        Of the request.
    wave : Wave
        Commanded voltage.
    direction : int
        +1 or -1 for steps, which soft limits stop; 0 for a direct voltage, which they do not.

    """

    name: str
    wave: Wave
    direction: int = 0


@dataclass(frozen=True)
class NoMove:
    """A checked request for no step at all."""

    name: str


@dataclass(frozen=True)
class Jog:
    """A checked request to step on while such requests come; without a move, to end it."""

    move: Move | None
    frequency_hz: float


@dataclass(frozen=True)
class Target:
    """A checked request for a position reading, m, in closed loop."""

    position_m: float


@dataclass(frozen=True)
class Load:
    """A checked request for an external force on the runner, N along +x."""

    force_n: float


@dataclass(frozen=True)
class Preload:
    """A checked request for another preload, N; the drive goes there at its preload rate."""

    force_n: float


@dataclass(frozen=True)
class Stop:
    """Hold the present voltage."""


@dataclass(frozen=True)
class Reset:
    """Go back to the state at the start: relaxed contacts, runner at 0, no load."""


@dataclass(frozen=True)
class ZeroPosition:
    """Make the present position reading 0."""


@dataclass(frozen=True)
class TareForce:
    """Make the present force reading 0."""


@dataclass(frozen=True)
class EnableAmplifier:
    """Switch the amplifier on or off."""

    wanted: bool


@dataclass(frozen=True)
class SetFaults:
    """A checked request for other faults than those of the moment."""

    settings: Mapping[str, Scalar]

    def applied_to(self, faults: FaultParameters) -> FaultParameters:
        """Return the faults that there are from now on."""
        changed = Parameters(fault=faults).updated(self.settings)
        return changed.fault


@dataclass(frozen=True)
class ClearFaults:
    """End every fault."""

    def applied_to(self, faults: FaultParameters) -> FaultParameters:
        """Return the faults that there are from now on: none."""
        return FaultParameters(schedule=faults.schedule)


Command = (
    Move
    | NoMove
    | Jog
    | Target
    | Load
    | Preload
    | Stop
    | Reset
    | ZeroPosition
    | TareForce
    | EnableAmplifier
    | SetFaults
    | ClearFaults
)
Check = Callable[..., Command]
