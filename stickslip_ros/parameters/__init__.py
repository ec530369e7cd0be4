"""Every number that can be set: declared once, with unit, bounds and source."""

from stickslip_ros.parameters.actuation_groups import ActuatorParameters, AmplifierParameters
from stickslip_ros.parameters.contact_groups import ContactParameters, FrictionLawParameters
from stickslip_ros.parameters.controller_group import ControllerParameters, controller_parameters
from stickslip_ros.parameters.fault_group import FaultParameters
from stickslip_ros.parameters.fields import Scalar, Spec, Unchosen, declared_by, find
from stickslip_ros.parameters.motion_groups import (
    ClosedLoopParameters,
    JogParameters,
    LimitsParameters,
    StepParameters,
)
from stickslip_ros.parameters.record_groups import RecordParameters, TraceParameters
from stickslip_ros.parameters.sensor_groups import InterferometerParameters, LoadCellParameters
from stickslip_ros.parameters.stand_groups import RunnerParameters, SimParameters, StandParameters
from stickslip_ros.parameters.strict_yaml import read_yaml
from stickslip_ros.parameters.tree import (
    Parameters,
    parse_assignments,
    spec_of,
    specs,
    to_nanoseconds,
)
from stickslip_ros.parameters.yaml_form import (
    describe,
    dump_yaml,
    format_value,
    load_values,
    load_yaml,
    parse_yaml,
)

__all__ = [
    'ActuatorParameters',
    'AmplifierParameters',
    'ClosedLoopParameters',
    'ContactParameters',
    'ControllerParameters',
    'FaultParameters',
    'FrictionLawParameters',
    'InterferometerParameters',
    'JogParameters',
    'LimitsParameters',
    'LoadCellParameters',
    'Parameters',
    'RecordParameters',
    'RunnerParameters',
    'Scalar',
    'SimParameters',
    'Spec',
    'StandParameters',
    'StepParameters',
    'TraceParameters',
    'Unchosen',
    'controller_parameters',
    'declared_by',
    'describe',
    'dump_yaml',
    'find',
    'format_value',
    'load_values',
    'load_yaml',
    'parse_assignments',
    'parse_yaml',
    'read_yaml',
    'spec_of',
    'specs',
    'to_nanoseconds',
]
