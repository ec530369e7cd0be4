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
    'ComparisonReport': 'study.comparison.result',
    'DriveRun': 'study.sawtooth_run',
    'Fit': 'study.fitting.fit',
    'LinearDrive': 'study.linear',
    'MeasuredResponse': 'study.swept_sine',
    'Output': 'instrument.reports',
    'Parameters': 'parameters',
    'Presliding': 'contact.mdr',
    'Request': 'instrument.commands',
    'Run': 'study.recorded_run',
    'SpringContact': 'contact.spring_contact',
    'StickSlipError': 'errors',
    'ZeroAmplitude': 'study.zero_amplitude',
    'compare': 'study.comparison.compare',
    'draw_step_map': 'study.step_map',
    'fit': 'study.fitting.fit',
    'force_onset_m': 'study.zero_amplitude',
    'linearise': 'study.linear',
    'load_yaml': 'parameters',
    'measure_response': 'study.swept_sine',
    'open_run': 'study.recorded_run',
    'presliding': 'contact.hemisphere',
    'run_drive': 'study.sawtooth_run',
    'simulate': 'study.sawtooth_run',
    'step_map': 'study.step_map',
    'sweep': 'study.sweep',
    'zero_amplitude': 'study.zero_amplitude',
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
    return sorted({*PUBLIC, *(name for name in globals() if name.startswith('__'))})
