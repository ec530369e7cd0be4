# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
A virtual stick-slip microdrive for ROS 2, computed from rough-contact mechanics.

PUBLIC is the interface for Python (docs/reference/python.md); all other names may change with any
version. A name is imported at its first use.

"""

from importlib import import_module
from typing import Any

__version__ = '1.0.0'

PUBLIC = {
    'Bench': 'instrument.bench',
    'CompareOptions': 'lab.comparison.compare',
    'ComparisonReport': 'lab.comparison.compare',
    'DriveRun': 'lab.measurements.run_result',
    'Fit': 'lab.fitting.report',
    'FitOptions': 'lab.fitting.fit',
    'Free': 'lab.fitting.free',
    'LinearDrive': 'lab.linear.linearise',
    'MeasuredResponse': 'lab.linear.swept_sine',
    'Output': 'instrument.reports',
    'Parameters': 'parameters',
    'Presliding': 'contact.mdr',
    'Request': 'instrument.commands',
    'Run': 'lab.measurements.recorded_run',
    'SpringContact': 'contact.spring_contact',
    'StickSlipError': 'errors',
    'ZeroAmplitude': 'lab.runs.zero_amplitude',
    'compare': 'lab.comparison.compare',
    'draw_stand': 'lab.drawing.picture',
    'fit': 'lab.fitting.fit',
    'force_onset_m': 'lab.runs.zero_amplitude',
    'linearise': 'lab.linear.linearise',
    'load_yaml': 'parameters',
    'measure_response': 'lab.linear.swept_sine',
    'open_run': 'lab.measurements.recorded_run',
    'presliding': 'contact.hemisphere',
    'robot_description': 'lab.drawing.urdf',
    'run_drive': 'lab.runs.sawtooth_run',
    'simulate': 'lab.runs.sawtooth_run',
    'stage_file': 'parameters.stages',
    'sweep': 'lab.runs.sweep',
    'zero_amplitude': 'lab.runs.zero_amplitude',
}
"""Public names and their modules; type checkers read them in __init__.pyi."""
__all__ = [*PUBLIC]  # noqa: PLE0604 - all are strings


def __getattr__(name: str) -> Any:
    """Import a public name."""
    if name not in PUBLIC:
        raise AttributeError(f'module {__name__!r} has no attribute {name!r}')
    if PUBLIC[name].startswith('lab.'):
        import_module(f'{__name__}.extras').require_lab(f'{__name__}.{name}')
    return getattr(import_module(f'{__name__}.{PUBLIC[name]}'), name)


def __dir__() -> list[str]:
    """List the public names, loaded or not."""
    return sorted([*PUBLIC, '__version__'])
