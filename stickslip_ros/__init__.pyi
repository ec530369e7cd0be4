"""The types of the public names."""

from stickslip_ros.contact.hemisphere import presliding as presliding
from stickslip_ros.contact.mdr import Presliding as Presliding
from stickslip_ros.contact.spring_contact import SpringContact as SpringContact
from stickslip_ros.errors import StickSlipError as StickSlipError
from stickslip_ros.instrument.bench import Bench as Bench
from stickslip_ros.instrument.commands import Request as Request
from stickslip_ros.instrument.reports import Output as Output
from stickslip_ros.lab.comparison.compare import CompareOptions as CompareOptions
from stickslip_ros.lab.comparison.compare import compare as compare
from stickslip_ros.lab.comparison.report import ComparisonReport as ComparisonReport
from stickslip_ros.lab.drawing.picture import draw_stand as draw_stand
from stickslip_ros.lab.drawing.urdf import robot_description as robot_description
from stickslip_ros.lab.fitting.fit import FitOptions as FitOptions
from stickslip_ros.lab.fitting.fit import fit as fit
from stickslip_ros.lab.fitting.free import Free as Free
from stickslip_ros.lab.fitting.report import Fit as Fit
from stickslip_ros.lab.linear.linearise import LinearDrive as LinearDrive
from stickslip_ros.lab.linear.linearise import linearise as linearise
from stickslip_ros.lab.linear.swept_sine import MeasuredResponse as MeasuredResponse
from stickslip_ros.lab.linear.swept_sine import measure_response as measure_response
from stickslip_ros.lab.runs.recorded_run import Run as Run
from stickslip_ros.lab.runs.recorded_run import open_run as open_run
from stickslip_ros.lab.runs.run_result import DriveRun as DriveRun
from stickslip_ros.lab.runs.sawtooth_run import run_drive as run_drive
from stickslip_ros.lab.runs.sawtooth_run import simulate as simulate
from stickslip_ros.lab.runs.sweep import sweep as sweep
from stickslip_ros.lab.runs.zero_amplitude import ZeroAmplitude as ZeroAmplitude
from stickslip_ros.lab.runs.zero_amplitude import force_onset_m as force_onset_m
from stickslip_ros.lab.runs.zero_amplitude import zero_amplitude as zero_amplitude
from stickslip_ros.parameters import Parameters as Parameters
from stickslip_ros.parameters import load_yaml as load_yaml
from stickslip_ros.parameters.stages import stage_file as stage_file

__version__: str
