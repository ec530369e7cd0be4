# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Parameters, each declared once with unit, bounds and source."""

from stickslip_ros.parameters.arguments import checked_arguments
from stickslip_ros.parameters.declaration import (
    AMPLITUDE_SPEC,
    FREQUENCY_SPEC,
    STROKE_SPEC,
    ReplaceableDefault,
    Scalar,
    Spec,
    declared_by,
)
from stickslip_ros.parameters.instrument_groups import FaultParameters
from stickslip_ros.parameters.physics_groups import (
    FEET_MAX,
    LAWS,
    AmplifierParameters,
    ContactParameters,
    FeetParameters,
    FootGroup,
    FrictionLawParameters,
    StandParameters,
)
from stickslip_ros.parameters.sensors import (
    SENSORS,
    TRUTH,
    InterferometerParameters,
    LoadCellParameters,
    Sensor,
)
from stickslip_ros.parameters.tree import (
    TRAVEL,
    Parameters,
    bare_name,
    column_name,
    is_fault,
    parse_assignments,
    spec_of,
    specs,
    to_nanoseconds,
)
from stickslip_ros.parameters.yaml_form import (
    NODE_NAME,
    describe,
    dump_yaml,
    format_value,
    load_values,
    load_yaml,
    parse_yaml,
    read_yaml,
)

__all__ = [
    'AMPLITUDE_SPEC',
    'FEET_MAX',
    'FREQUENCY_SPEC',
    'LAWS',
    'NODE_NAME',
    'SENSORS',
    'STROKE_SPEC',
    'TRAVEL',
    'TRUTH',
    'AmplifierParameters',
    'ContactParameters',
    'FaultParameters',
    'FeetParameters',
    'FootGroup',
    'FrictionLawParameters',
    'InterferometerParameters',
    'LoadCellParameters',
    'Parameters',
    'ReplaceableDefault',
    'Scalar',
    'Sensor',
    'Spec',
    'StandParameters',
    'bare_name',
    'checked_arguments',
    'column_name',
    'declared_by',
    'describe',
    'dump_yaml',
    'format_value',
    'is_fault',
    'load_values',
    'load_yaml',
    'parse_assignments',
    'parse_yaml',
    'read_yaml',
    'spec_of',
    'specs',
    'to_nanoseconds',
]
