"""
A virtual stick-slip microdrive for ROS 2, computed from rough-contact mechanics.

What is named here is the public interface for Python, docs/python.md; what else the package
holds may change with any version. A name is imported when it is first used.

"""

from importlib import import_module
from typing import Any

__version__ = '0.1.0'

PUBLIC = {
    'Bench': 'instrument.bench',
    'ComparisonReport': 'study.library',
    'Fit': 'study.fitting.fit',
    'LinearDrive': 'study.linear',
    'MeasuredResponse': 'study.swept_sine',
    'Output': 'instrument.reports',
    'Parameters': 'parameters',
    'Presliding': 'contact.mdr',
    'Request': 'instrument.commands',
    'Run': 'study.library',
    'StickSlipError': 'errors',
    'ZeroAmplitude': 'study.zero_amplitude',
    'compare': 'study.library',
    'draw_step_map': 'study.step_map',
    'fit': 'study.library',
    'linearise': 'study.linear',
    'load_yaml': 'parameters',
    'measure_response': 'study.swept_sine',
    'open_run': 'study.library',
    'presliding': 'study.library',
    'simulate': 'study.library',
    'step_map': 'study.step_map',
    'sweep': 'study.library',
    'zero_amplitude': 'study.library',
}
"""Public names and the modules that they come from; type checkers read them in __init__.pyi."""


def __getattr__(name: str) -> Any:
    """Import a public name."""
    if name not in PUBLIC:
        raise AttributeError(f'module {__name__!r} has no attribute {name!r}')
    return getattr(import_module(f'{__name__}.{PUBLIC[name]}'), name)


def __dir__() -> list[str]:
    """List the public names beside what is loaded."""
    return sorted({*globals(), *PUBLIC})
