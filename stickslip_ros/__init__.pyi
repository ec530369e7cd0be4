"""
The types of the public names: quantities are SI numbers or typed, a mapping is a stand too.

Here alone: within the package, ``checked_arguments`` has made numbers and Parameters of them.

"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import TypeAlias

from matplotlib.figure import Figure
from numpy.typing import ArrayLike
from pandas import DataFrame

from stickslip_ros.contact.mdr import Presliding as Presliding
from stickslip_ros.contact.spring_contact import SpringContact as _SpringContact
from stickslip_ros.errors import StickSlipError as StickSlipError
from stickslip_ros.instrument.bench import Bench as _Bench
from stickslip_ros.instrument.commands import Request as _Request
from stickslip_ros.instrument.joints import Joints
from stickslip_ros.instrument.reports import Output as Output
from stickslip_ros.lab.comparison.compare import CompareOptions as _CompareOptions
from stickslip_ros.lab.comparison.compare import ComparisonReport as ComparisonReport
from stickslip_ros.lab.drawing.picture import Drawing
from stickslip_ros.lab.experiments.experiment import Experiment
from stickslip_ros.lab.fitting.fit import FitOptions as _FitOptions
from stickslip_ros.lab.fitting.free import Free as Free
from stickslip_ros.lab.fitting.free import FreeParameters, KnownValue
from stickslip_ros.lab.fitting.report import Fit as Fit
from stickslip_ros.lab.linear.linearise import LinearDrive as LinearDrive
from stickslip_ros.lab.linear.swept_sine import MeasuredResponse as MeasuredResponse
from stickslip_ros.lab.measurements.recorded_run import Run as _Run
from stickslip_ros.lab.measurements.recorded_run import RunTable
from stickslip_ros.lab.measurements.run_result import DriveRun as DriveRun
from stickslip_ros.lab.measurements.run_result import SawtoothRun
from stickslip_ros.lab.measurements.vocabulary import MeasuredTable
from stickslip_ros.lab.readers.formats import Table
from stickslip_ros.lab.runs.batch import Progress
from stickslip_ros.lab.runs.zero_amplitude import ZeroAmplitude as ZeroAmplitude
from stickslip_ros.parameters import Parameters as Parameters
from stickslip_ros.parameters import Scalar
from stickslip_ros.parameters import load_yaml as load_yaml
from stickslip_ros.parameters.stages import stage_file as stage_file
from stickslip_ros.recording.series import Series

__version__: str
_Quantity: TypeAlias = float | str
_Quantities: TypeAlias = _Quantity | Sequence[_Quantity]
_Stand: TypeAlias = Parameters | Mapping[str, object]

class Bench(_Bench):
    def __init__(self, parameters: _Stand) -> None: ...

class Request(_Request):
    def __init__(
        self,
        name: str,
        values: _Quantities = (),
        settings: tuple[tuple[str, Scalar], ...] = (),
        stamp_ns: int = 0,
        frame_id: str = '',
        joints: Joints = ...,
        cycles: int = 1,
        tag: str = '',
    ) -> None: ...

class SpringContact(_SpringContact):
    def __init__(
        self,
        parameters: _Stand,
        normal_force_max_n: _Quantity,
        *,
        rig_n_per_m: _Quantity = 0.0,
    ) -> None: ...

class CompareOptions(_CompareOptions):
    def __init__(
        self,
        *,
        headers: Mapping[str, str] = ...,
        preloads_n: _Quantities = (),
        rate_hz: _Quantity | None = None,
        commands: Table | None = None,
        window_s: Sequence[_Quantity] | None = None,
        load_n: _Quantity = 0.0,
        slope_deg: float = 0.0,
        frequency_hz: _Quantity = 1000.0,
        steps: int = 0,
        workers: int = 0,
        shift_s: _Quantity | None = None,
        align: bool = False,
        offset: bool = False,
    ) -> None: ...

class FitOptions(_FitOptions):
    def __init__(
        self,
        *,
        headers: Mapping[str, str] = ...,
        preloads_n: _Quantities = (),
        rate_hz: _Quantity | None = None,
        commands: Table | None = None,
        window_s: Sequence[_Quantity] | None = None,
        load_n: _Quantity = 0.0,
        slope_deg: float = 0.0,
        frequency_hz: _Quantity = 1000.0,
        steps: int = 0,
        workers: int = 0,
        drift_m_per_s: _Quantity = 1e-6,
        starts: int = 5,
        assume: Mapping[str, KnownValue | str] = ...,
    ) -> None: ...

class Run(_Run):
    def __init__(
        self,
        path: Table | Sequence[Table] | None,
        result: SawtoothRun | None = None,
        folder: Path | None = None,
        topics: Mapping[str, str] | None = None,
    ) -> None: ...
    def series_within(self, start_s: _Quantity, end_s: _Quantity) -> dict[str, Series]: ...
    def table(self, window_s: Sequence[_Quantity] | None = None) -> RunTable: ...
    def plot(
        self,
        start_s: _Quantity | None = None,
        end_s: _Quantity | None = None,
        *,
        style: str = '',
        width_mm: float | None = None,
    ) -> Figure: ...

def open_run(path: Table | Sequence[Table], topics: Mapping[str, str] | None = None) -> Run: ...
def simulate(
    parameters: _Stand | None = None,
    *,
    amplitude_m: _Quantity | None = None,
    voltage_v: _Quantity | None = None,
    waveform: ArrayLike | None = None,
    frequency_hz: _Quantity | None = None,
    steps: int = 0,
    record: str | Path | bool = True,
    progress: bool | Progress = False,
) -> Run: ...
def run_drive(
    parameters: _Stand,
    amplitude_m: _Quantity,
    frequency_hz: _Quantity,
    steps: int = 0,
    *,
    load_n: _Quantity = 0.0,
) -> DriveRun: ...
def zero_amplitude(
    parameters: _Stand,
    frequency_hz: _Quantity = 200.0,
    *,
    steps: int = 120,
    workers: int = 0,
    progress: bool | Progress = False,
) -> ZeroAmplitude: ...
def force_onset_m(
    parameters: _Stand, frequency_hz: _Quantity, threshold_n: _Quantity = 0.0
) -> float: ...
def sweep(
    parameters: _Stand,
    values: Mapping[str, Iterable[Scalar] | Scalar],
    *,
    steps: int = 0,
    workers: int = 0,
    progress: bool | Progress = False,
) -> DataFrame: ...
def presliding(parameters: _Stand, *, normal_force_n: _Quantity) -> Presliding: ...
def linearise(parameters: _Stand, at_voltage_v: _Quantity | None = None) -> LinearDrive: ...
def measure_response(
    parameters: _Stand,
    frequency_hz: ArrayLike,
    at_voltage_v: _Quantity | None = None,
    *,
    workers: int = 0,
    progress: bool = False,
) -> MeasuredResponse: ...
def compare(
    a: Table | _Run | Sequence[Table],
    b: Table | _Run | _Stand | None = None,
    *,
    options: _CompareOptions = ...,
    draws: Sequence[_Stand] = (),
    report: Callable[[MeasuredTable], None] | None = None,
    progress: bool | Progress = False,
) -> ComparisonReport: ...
def fit(
    experiments: Table | _Run | Experiment | Sequence[Table | _Run | Experiment],
    free: FreeParameters,
    *,
    parameters: _Stand | None = None,
    options: _FitOptions = ...,
    report: Callable[[MeasuredTable], None] | None = None,
    progress: bool | Progress = False,
) -> Fit: ...
def draw_stand(stand: _Stand | _Run, end_s: _Quantity | None = None) -> Drawing: ...
def robot_description(parameters: _Stand, *carried: _Stand) -> str: ...
