"""
A virtual stick-slip microdrive for ROS 2, computed from rough-contact mechanics.

What is named here is the public interface for Python, docs/reference/python.md; what else the
package holds may change with any version. A name is imported when it is first used.

"""

from importlib import import_module
from typing import Any

__version__ = '0.1.0'

PUBLIC = {
    'Bench': 'instrument.bench',
    'ComparisonReport': 'comparison.result',
    'DriveRun': 'runs.sawtooth_run',
    'Fit': 'fitting.fit',
    'LinearDrive': 'linear.linearise',
    'MeasuredResponse': 'linear.swept_sine',
    'Output': 'instrument.reports',
    'Parameters': 'parameters',
    'Presliding': 'contact.mdr',
    'Request': 'instrument.commands',
    'Run': 'runs.recorded_run',
    'SpringContact': 'contact.spring_contact',
    'StickSlipError': 'errors',
    'ZeroAmplitude': 'runs.zero_amplitude',
    'compare': 'comparison.compare',
    'draw_stand': 'drawing.picture',
    'draw_step_map': 'runs.step_map',
    'fit': 'fitting.fit',
    'force_onset_m': 'runs.zero_amplitude',
    'linearise': 'linear.linearise',
    'load_yaml': 'parameters',
    'measure_response': 'linear.swept_sine',
    'open_run': 'runs.recorded_run',
    'presliding': 'contact.hemisphere',
    'robot_description': 'drawing.urdf',
    'run_drive': 'runs.sawtooth_run',
    'simulate': 'runs.sawtooth_run',
    'step_map': 'runs.step_map',
    'sweep': 'runs.sweep',
    'zero_amplitude': 'runs.zero_amplitude',
}
"""Public names and the modules that they come from; type checkers read them in __init__.pyi."""
__all__ = [*PUBLIC]  # noqa: PLE0604 - all are strings


def __getattr__(name: str) -> Any:
    """Import a public name."""
    if name not in PUBLIC:
        raise AttributeError(f'module {__name__!r} has no attribute {name!r}')
    return getattr(import_module(f'{__name__}.{PUBLIC[name]}'), name)


def __dir__() -> list[str]:
    """List the public names, whatever is loaded."""
    return sorted([*PUBLIC, '__version__'])
