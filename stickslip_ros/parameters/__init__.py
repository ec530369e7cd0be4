"""Every number that can be set: declared once, with unit, bounds and source."""

from stickslip_ros.parameters.contact_groups import ContactParameters, FrictionLawParameters
from stickslip_ros.parameters.fields import Scalar, Spec
from stickslip_ros.parameters.groups import (
    ActuatorParameters,
    AmplifierParameters,
    InterferometerParameters,
    LoadCellParameters,
    RecordParameters,
    RunnerParameters,
    SimParameters,
    StandParameters,
    TraceParameters,
)
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
    load_yaml,
    parse_yaml,
)

__all__ = [
    'ActuatorParameters',
    'AmplifierParameters',
    'ContactParameters',
    'FrictionLawParameters',
    'InterferometerParameters',
    'LoadCellParameters',
    'Parameters',
    'RecordParameters',
    'RunnerParameters',
    'Scalar',
    'SimParameters',
    'Spec',
    'StandParameters',
    'TraceParameters',
    'describe',
    'dump_yaml',
    'format_value',
    'load_yaml',
    'parse_assignments',
    'parse_yaml',
    'spec_of',
    'specs',
    'to_nanoseconds',
]
