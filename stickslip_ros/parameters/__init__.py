# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Parameters, each declared once with unit, bounds and source."""

# ruff: noqa: I001 - `as` hands a name on; isort would give each an import of its own

from stickslip_ros.parameters.arguments import checked_arguments as checked_arguments
from stickslip_ros.parameters.declaration import (
    AMPLITUDE_SPEC as AMPLITUDE_SPEC,
    FREQUENCY_SPEC as FREQUENCY_SPEC,
    STROKE_SPEC as STROKE_SPEC,
    ReplaceableDefault as ReplaceableDefault,
    Scalar as Scalar,
    Spec as Spec,
    declared_by as declared_by,
)
from stickslip_ros.parameters.instrument_groups import FaultParameters as FaultParameters
from stickslip_ros.parameters.physics_groups import (
    FEET_MAX as FEET_MAX,
    LAWS as LAWS,
    AmplifierParameters as AmplifierParameters,
    ContactParameters as ContactParameters,
    FeetParameters as FeetParameters,
    FootGroup as FootGroup,
    FrictionLawParameters as FrictionLawParameters,
    StandParameters as StandParameters,
)
from stickslip_ros.parameters.sensors import (
    SENSORS as SENSORS,
    TRUTH as TRUTH,
    InterferometerParameters as InterferometerParameters,
    LoadCellParameters as LoadCellParameters,
    Sensor as Sensor,
)
from stickslip_ros.parameters.tree import (
    TRAVEL as TRAVEL,
    Parameters as Parameters,
    bare_name as bare_name,
    column_name as column_name,
    differ_when_built as differ_when_built,
    is_fault as is_fault,
    parse_assignments as parse_assignments,
    spec_of as spec_of,
    specs as specs,
    to_nanoseconds as to_nanoseconds,
)
from stickslip_ros.parameters.yaml_form import (
    NODE_NAME as NODE_NAME,
    describe as describe,
    dump_yaml as dump_yaml,
    format_value as format_value,
    load_ranges as load_ranges,
    load_values as load_values,
    load_yaml as load_yaml,
    parse_yaml as parse_yaml,
    read_yaml as read_yaml,
)
