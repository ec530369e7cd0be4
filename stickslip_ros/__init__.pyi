"""The types of the public names."""

from stickslip_ros.contact.mdr import Presliding as Presliding
from stickslip_ros.errors import StickSlipError as StickSlipError
from stickslip_ros.instrument.bench import Bench as Bench
from stickslip_ros.instrument.commands import Request as Request
from stickslip_ros.instrument.reports import Output as Output
from stickslip_ros.parameters import Parameters as Parameters
from stickslip_ros.parameters import load_yaml as load_yaml
from stickslip_ros.study.fitting.fit import Fit as Fit
from stickslip_ros.study.library import ComparisonReport as ComparisonReport
from stickslip_ros.study.library import Run as Run
from stickslip_ros.study.library import compare as compare
from stickslip_ros.study.library import fit as fit
from stickslip_ros.study.library import open_run as open_run
from stickslip_ros.study.library import presliding as presliding
from stickslip_ros.study.library import simulate as simulate
from stickslip_ros.study.library import sweep as sweep
from stickslip_ros.study.library import zero_amplitude as zero_amplitude
from stickslip_ros.study.linear import LinearDrive as LinearDrive
from stickslip_ros.study.linear import linearise as linearise
from stickslip_ros.study.step_map import draw_step_map as draw_step_map
from stickslip_ros.study.step_map import step_map as step_map
from stickslip_ros.study.swept_sine import MeasuredResponse as MeasuredResponse
from stickslip_ros.study.swept_sine import measure_response as measure_response
from stickslip_ros.study.zero_amplitude import ZeroAmplitude as ZeroAmplitude

__version__: str
