# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
What may be typed: a verb with its options.

Nothing here imports what takes long: help, completion and refusals do without it.

"""

import argparse
import re
from collections.abc import Callable
from importlib import import_module
from typing import TYPE_CHECKING, Any, NamedTuple

from stickslip_ros.errors import StickSlipError, quoted

if TYPE_CHECKING:
    from pathlib import Path

    from stickslip_ros.lab.cli.printing import Answer

# ruff: noqa: PLC0415 - see above

UNITS = {'m': 'm', 'n': 'N', 'v': 'V', 's': 's', 'hz': 'Hz'}
"""Units by the endings of names."""
Option = Callable[[Any], object]
"""An option adds itself to a parser of argparse, or to a group of one."""


class Verb(NamedTuple):
    """A verb of ``stickslip``."""

    name: str
    summary: str
    description: str
    options: tuple[Option, ...]
    module: str  # module of this package whose ``<name>_verb`` makes the answer
    reports_compilation: bool = False  # the verb says itself that it compiles
    takes_ros_arguments: bool = False  # ``--ros-args`` and what follows are for it

    def fill(self, parser: argparse.ArgumentParser) -> None:
        """Add description and options to its parser."""
        parser.description = self.description
        for add in (*self.options, switch('--json', 'print one JSON object, SI units')):
            add(parser)
        parser.set_defaults(verb=self)

    def load(self) -> 'Callable[[argparse.Namespace], Answer]':
        """Import what answers."""
        module = import_module(f'stickslip_ros.lab.cli.{self.module}')
        answer: Callable[[argparse.Namespace], Answer]
        answer = getattr(module, f'{self.name.replace("-", "_")}_verb')
        return answer


def verb(
    name: str, summary: str, description: str, *options: Option, module: str = '', **traits: bool
) -> Verb:
    """Return a verb, whose module has its name unless another one is given."""
    return Verb(name, summary, description, options, module or name, **traits)


def option(
    flags: str,
    text: str,
    kind: Callable[[str], Any] | None = None,
    metavar: str | None = None,
    unit: str = '',
    **more: Any,
) -> Option:
    """
    Return an option, as ``-o --output``, or an argument, which has no dashes.

    The text becomes its help, with the default behind it unless it names one. One with a ``unit``
    is a quantity, and shown as that. Paths are shown as FILE and whole numbers as N unless a
    ``metavar`` says otherwise; ``more`` goes to argparse.

    """
    default = more.get('default')
    if default and 'default: ' not in text:
        text += ' (default: %(default)s)'
    if metavar is None and (flags.startswith('-') or kind is to_path):
        metavar = {to_path: 'FILE', int: 'N'}.get(kind) or unit.upper() or None
    if unit:
        kind = _to_quantity(flags.rsplit(maxsplit=1)[-1], unit)
    if kind is not None:
        more['type'] = kind
    return lambda to: to.add_argument(*flags.split(), metavar=metavar, help=text, **more)


def of_function(function: str, *names: str, **more: Any) -> tuple[Option, ...]:
    """
    Return options for arguments of a function, as ``study.sweep.sweep``.

    What it declares says default, unit and help; ``more`` goes to argparse instead. Its source is
    read, not imported, which takes long.

    """

    def of_one(name: str) -> Option:
        stem, _, unit = name.rpartition('_')
        stem, unit = (stem, UNITS[unit]) if unit in UNITS else (name, '')
        flag = f'--{stem}'.replace('_', '-')

        def add(to: Any) -> object:
            declared = _declared(function)[name]
            if declared.kind == 'bool':
                return switch(flag, declared.text)(to)
            text, default = declared.text.removesuffix(f', {unit}'), declared.default
            if unit and default is not None:
                text += f' (default: {default:g}{unit})'
            kind = None if unit else {'int': int, 'float': float}.get(declared.kind)
            return option(flag, text, kind, unit=unit, **{'default': default, **more})(to)

        return add

    return tuple(map(of_one, names))


class _Declared(NamedTuple):
    """An argument as its function declares it: annotation, default, what the docstring says."""

    kind: str
    default: Any
    text: str


def _declared(function: str) -> dict[str, _Declared]:
    import ast
    import re
    from pathlib import Path

    module, _, name = function.rpartition('.')
    path = Path(__file__).parents[1].joinpath(*module.split('.')).with_suffix('.py')
    body = ast.parse(path.read_text(encoding='utf-8')).body
    [found] = (each for each in body if isinstance(each, ast.FunctionDef) and each.name == name)
    sections = f'{ast.get_docstring(found)}\n'
    texts = dict(re.findall(r'^(\w+) : .*\n((?: {4}.*\n)+)', sections, re.MULTILINE))
    arguments = [*found.args.args, *found.args.kwonlyargs]
    defaults = [*found.args.defaults, *found.args.kw_defaults]
    declared = {}
    for each, default in zip(arguments[-len(defaults) :], defaults, strict=True):
        text = ' '.join(texts.get(each.arg, '').split()).rstrip('.')
        value = default.value if isinstance(default, ast.Constant) else None
        kind = ast.unparse(each.annotation) if each.annotation else ''
        declared[each.arg] = _Declared(kind, value, text[:1].lower() + text[1:])
    return declared


def _to_quantity(flag: str, unit: str) -> Callable[[str], float]:
    """Return what reads a quantity in a unit, and refuses in one line, not with the usage."""

    def convert(text: str) -> float:
        from stickslip_ros.parameters.typed import to_si

        try:
            return to_si(flag, text, unit)
        except TypeError as error:  # of which argparse would make a line of its own
            raise StickSlipError(str(error)) from None

    return convert


def to_namespace(text: str) -> str:
    """Return a namespace as ROS takes it; refuse another."""
    if not re.fullmatch(r'/?([a-z_]\w*(/[a-z_]\w*)*/?)?', text, re.ASCII | re.IGNORECASE):
        why = f'--namespace {quoted(text)} is not made of letters, digits, _ and /'
        raise StickSlipError(f'{why}; give one such as /left')
    name = text.strip('/')
    return name and f'/{name}'


def many(flags: str, text: str, metavar: str, kind: Any = str, **more: Any) -> Option:
    """Return an option that may be repeated."""
    return option(
        flags, f'{text}; may be repeated', kind, metavar, action='append', default=[], **more
    )


def switch(flag: str, text: str, **more: Any) -> Option:
    """Return an option without a value; with a ``const`` and a ``dest`` it stands for that."""
    action = 'store_const' if 'const' in more else 'store_true'
    return lambda to: to.add_argument(flag, action=action, help=text, **more)


def either(*options: Option, required: bool = False) -> Option:
    """Return options of which one at most, or exactly one, may be given."""

    def add(to: Any) -> None:
        group = to.add_mutually_exclusive_group(required=required)
        for each in options:
            each(group)

    return add


def titled(title: str, *options: Option) -> Option:
    """Return options under a title of their own."""

    def add(to: Any) -> None:
        group = to.add_argument_group(title)
        for each in options:
            each(group)

    return add


def to_path(text: str) -> 'Path':
    """Return a path as it is typed; of ``.`` and ``..``, which have no name, the whole one."""
    from pathlib import Path

    from stickslip_ros.errors import RecordingError

    if text in {'', '-'}:
        raise RecordingError(repr(text), 'is no name of a file', 'give a path')
    path = Path(text)
    return path if path.name not in {'', '..'} else path.resolve()


def file(text: str, **more: Any) -> Option:
    """Return the argument that names what a verb reads."""
    name = 'files' if more.get('nargs') == '+' else 'file'
    return option(name, text, to_path, **more)


def output(text: str, **more: Any) -> Option:
    """Return the option that names what a verb writes."""
    return option('-o --output', text, to_path, **more)


def folder(default: str = 'runs') -> Option:
    """Return the option that names the folder into which a verb writes."""
    return output('folder to write into', metavar='DIR', default=default)


WORKERS = option('--workers', 'threads (default: one per core)', int, default=0)
LOOK = (
    option(
        '--style',
        'of the figure: screen; paper, 85 mm wide with letters of 8 pt; a file NAME.mplstyle',
        metavar='STYLE',
        default='',
    ),
    option('--width', 'of the figure, as 170mm; means --style paper', unit='m', metavar='WIDTH'),
)
FIGURE = (option('--figure', 'draw a figure: .png, .svg or .pdf', to_path), *LOOK)
DRAWS = option(
    '--draws',
    'a fit (.json of stickslip fit): its stand, and bands of what is not known of it',
    to_path,
)
PARAMETERS = (
    many(
        '--params',
        'ROS parameter file, as config/test_stand.yaml; later ones win',
        'FILE',
        to_path,
    ),
    many(
        '--set',
        'set one parameter, as stand.preload=250mN; wins over --params',
        'GROUP.NAME=VALUE',
        dest='assignments',
    ),
)
"""What chooses a stand. An option whose ``dest`` is the name of a parameter does so too."""
NAMESPACE = option('--namespace', 'of the drive, as /left', to_namespace, 'NAME', default='')
PRELOAD = option('--preload', 'sets stand.preload', metavar='NEWTON', dest='stand.preload')
NO_LOAD_CELL = switch(
    '--no-load-cell',
    'a free runner: sets load_cell.contact=absent',
    dest='load_cell.contact',
    const='absent',
)
MAP = many(
    '--map',
    'column of a table, or topic and field of a recording, that holds a quantity, and its unit, '
    'as force_n="Force (mN)" or position_m=/rig/encoder.point.x',
    'NAME=HEADER',
    dest='headers',
)
MAP_FILE = option('--map-file', 'YAML file of such names and headers; --map wins', to_path)
OF_FILES = many(
    '--preload',
    'preload of files that name none: one of all, or one of each, with commas',
    'NEWTONS',
)
