"""A positioning run: drive and controller in one process, in lockstep, over topics, recorded."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.parameter import Parameter

from stickslip_ros.errors import OutOfRange, RecordingError, StickSlipError
from stickslip_ros.parameters import Parameters
from stickslip_ros.process.stopping import stop_if_asked
from stickslip_ros.ros.client import Commands, open_context
from stickslip_ros.ros.executable import end_node, stay_on_this_host
from stickslip_ros.ros.node import StickSlipDrive
from stickslip_ros.ros.position_controller import PositionController

TARGETS_M = (100e-9, 1e-6, 10e-6, 100e-6)
LOAD_N = 0.05
HOLD_S = 0.4
"""Time for which every target is held, and after the load has come."""
PATIENCE_S = 20.0
"""Simulated time after which a target counts as not reached."""
SPIN_S = 0.1
SILENCE_SPINS = 100
"""Spins without a reading after which the drive counts as gone."""


@dataclass(frozen=True)
class Leg:
    """
    One target of a run, or the load on the last one.

    Attributes
    ----------
    target_m : float
        Where the runner shall be, m.
    load_n : float
        External load, N.
    start_s, arrival_s, end_s : float
        Simulated times: asked for, in position, held until.

    """

    target_m: float
    load_n: float
    start_s: float
    arrival_s: float
    end_s: float


class ScriptedController(PositionController):
    """
    A position controller that works through a list of targets, and a load at the end.

    Parameters
    ----------
    targets_m : sequence of float
        Positions to go to, m.
    load_n : float
        Load on the last one, N; 0 is none.
    stand : Parameters
        The stand that it shall know.

    """

    def __init__(
        self,
        targets_m: Sequence[float],
        load_n: float,
        stand: Parameters,
        **node_arguments: Any,
    ) -> None:
        self.legs: list[Leg] = []
        self.readings = 0
        self._plan = [(target_m, 0.0) for target_m in targets_m]
        if load_n:
            self._plan.append((targets_m[-1], load_n))
        self._begun_s: float | None = None
        self._arrival_s: float | None = None
        values = {'lockstep': True} | _known_of(stand)
        overrides = [Parameter(name, value=value) for name, value in values.items()]
        super().__init__(parameter_overrides=overrides, **node_arguments)

    @property
    def planned(self) -> int:
        """How many legs there shall be."""
        return len(self._plan)

    @property
    def is_done(self) -> bool:
        """Whether every leg is over."""
        return len(self.legs) == self.planned

    def _answer(self, time_s: float, position_m: float) -> Commands:
        self.readings += 1
        if self.is_done:
            return []
        target_m, load_n = self._plan[len(self.legs)]
        commands: list[tuple[str, Any]] = []
        if self._begun_s is None:
            self._begun_s, self._arrival_s = time_s, None
            self.loop.aim(target_m)
            if load_n:
                commands.append(('load', load_n))
        commands += super()._answer(time_s, position_m)
        self._look(time_s, target_m, load_n)
        return commands

    def _look(self, time_s: float, target_m: float, load_n: float) -> None:
        """Note arrival and end of a leg."""
        begun_s = self._begun_s or 0.0
        if self._arrival_s is None and self.loop.in_position:
            self._arrival_s = time_s
        arrival_s = begun_s if load_n else self._arrival_s
        if arrival_s is None:
            if time_s - begun_s > PATIENCE_S:
                raise StickSlipError(f'{target_m:g} m was not reached in {PATIENCE_S:g} s')
        elif time_s - arrival_s >= HOLD_S:
            self.legs.append(Leg(target_m, load_n, begun_s, self._arrival_s or time_s, time_s))
            self._begun_s = None


def _known_of(stand: Parameters) -> dict[str, float]:
    """Return the parameters of a controller that are properties of its stand."""
    return {
        'gain': stand.actuator.gain,
        'voltage_min': stand.amplifier.voltage_min,
        'voltage_max': stand.amplifier.voltage_max,
        'step_amplitude': stand.step.amplitude,
        'step_frequency': stand.step.frequency,
        'block': stand.sim.block,
    }


def run_positioning(
    parameters: Parameters,
    path: Path,
    targets_m: Sequence[float] = TARGETS_M,
    load_n: float = LOAD_N,
    progress: Callable[[int, int], None] = lambda *_: None,
) -> list[Leg]:
    """
    Let a controller bring the runner to some targets, over topics, and record the run.

    Parameters
    ----------
    parameters : Parameters
        The stand; lockstep, truth topics and recording are switched on.
    path : Path
        Recording to write.
    targets_m : sequence of float
        Positions, m, one after the other.
    load_n : float
        External load that comes at the end, N; 0 is none.
    progress : callable
        Receives how many targets are done, and of how many; a load counts as one.

    Raises
    ------
    OutOfRange
        If there is no target.
    RecordingError
        If the recording exists.
    StickSlipError
        If a target is not reached or the drive stops.

    """
    if not targets_m:
        raise OutOfRange('targets', 0, '', 'none', 'give at least one position in m')
    if path.exists():
        raise RecordingError(path, 'exists', 'choose another name')
    stand = parameters.updated(
        {
            'sim.lockstep': True,
            'sim.publish_truth': True,
            'record.on_start': True,
            'record.directory': str(path.parent),
            'record.name': path.name,
        }
    )
    stay_on_this_host()
    context = open_context()
    try:
        controller = ScriptedController(targets_m, load_n, stand, context=context)
        return _run(stand, controller, context, progress)
    finally:
        context.try_shutdown()


def _run(
    stand: Parameters,
    controller: ScriptedController,
    context: Context,
    progress: Callable[[int, int], None],
) -> list[Leg]:
    values = stand.flat()
    overrides = [Parameter(name, value=value) for name, value in values.items()]
    drive = StickSlipDrive(context=context, parameter_overrides=overrides)
    executor = SingleThreadedExecutor(context=context)
    executor.add_node(drive)
    executor.add_node(controller)
    silent, readings = 0, 0
    try:
        while not controller.is_done:
            stop_if_asked()
            executor.spin_once(timeout_sec=SPIN_S)
            progress(len(controller.legs), controller.planned)
            silent = 0 if controller.readings > readings else silent + 1
            readings = controller.readings
            if silent > SILENCE_SPINS:
                silence_s = SPIN_S * SILENCE_SPINS
                raise StickSlipError(f'the drive gave no reading for {silence_s:g} s')
    finally:
        end_node(executor, drive, controller)
    return controller.legs
