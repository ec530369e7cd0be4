# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
What may be typed: a verb with its options.

Nothing here imports what takes long: help, completion and refusals do without it.

"""

import argparse
import itertools
import re
from collections.abc import Callable
from functools import cache, partial
from importlib import import_module
from typing import TYPE_CHECKING, Any, NamedTuple

from stickslip_ros.errors import StickSlipError, quoted

if TYPE_CHECKING:
    from pathlib import Path

    from stickslip_ros.lab.cli.printing import Answer

# ruff: noqa: PLC0415 - see above

UNITS = {'m_per_s': 'm/s', 'm': 'm', 'n': 'N', 'v': 'V', 's': 's', 'hz': 'Hz'}
"""Units by the endings of names."""
FLAGS = {'headers': '--map', 'preloads_n': '--preload'}
"""Flags that are not the name of their field."""
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
        flag = flags.rsplit(maxsplit=1)[-1]
        kind = lambda text: _late('parameters.typed.to_si')(flag, text, unit)  # noqa: E731
    if kind is not None:
        more['type'] = kind
    return lambda to: to.add_argument(*flags.split(), metavar=metavar, help=text, **more)


def options_of(owner: str, *names: str) -> tuple[Option, ...]:
    """
    Return options for arguments of a function or fields of a record, as ``runs.sweep.sweep``.

    Name, annotation, default and documentation give flag, unit, kind and help, see ``_FORMS``.
    The source is read, not imported, which takes long. An option that is not typed is None.

    """
    return tuple(partial(_add_declared, owner, name) for name in names)


def _add_declared(owner: str, name: str, to: Any) -> object:
    kind, default, text = _declared(owner)[name]
    ending = next((each for each in UNITS if name.endswith(f'_{each}')), '')
    stem, unit = name.removesuffix(f'_{ending}'), UNITS.get(ending, '')
    flag = FLAGS.get(name, f'--{stem}'.replace('_', '-'))
    text = text.removesuffix(f', {unit}').replace('%', '%%')
    if kind == 'bool':
        return switch(flag, text, dest=name)(to)
    if default:
        text += f' (default: {default:g}{unit})'
    if kind not in _FORMS:
        number = {'int': int, 'float': float}.get(kind)
        return option(flag, text, number, unit=unit, dest=name)(to)
    convert, metavar, hint, more = _FORMS[kind]
    read = partial(convert, f'{flag} {metavar}')
    return option(flag, text + hint, read, metavar, dest=name, **more)(to)


@cache
def _declared(owner: str) -> dict[str, tuple[str, Any, str]]:
    """Return annotation, default and documentation of arguments or fields, out of the source."""
    import ast
    from pathlib import Path

    module, _, name = owner.rpartition('.')
    path = Path(__file__).parents[1].joinpath(*module.split('.')).with_suffix('.py')
    body = ast.parse(path.read_text(encoding='utf-8')).body
    [found] = (each for each in body if getattr(each, 'name', '') == name)
    rows: list[tuple[str, ast.expr | None, ast.expr | None, str]] = []
    if isinstance(found, ast.ClassDef):  # each field has its docstring below
        for each, below in itertools.pairwise(found.body):
            if isinstance(each, ast.AnnAssign) and isinstance(below, ast.Expr):
                text = ast.literal_eval(below.value).strip().partition('\n\n')[0]
                rows.append((ast.unparse(each.target), each.annotation, each.value, text))
    elif isinstance(found, ast.FunctionDef):
        sections = f'{ast.get_docstring(found)}\n'
        texts = dict(re.findall(r'^(\w+) : .*\n((?: {4}.*\n)+)', sections, re.MULTILINE))
        arguments = [*found.args.args, *found.args.kwonlyargs]
        defaults = [*found.args.defaults, *found.args.kw_defaults]
        for one, value in zip(arguments[-len(defaults) :], defaults, strict=True):
            rows.append((one.arg, one.annotation, value, texts.get(one.arg, '')))
    declared = {}
    for name, annotation, value, text in rows:
        kind = ast.unparse(annotation).strip("'") if annotation else ''
        words = ' '.join(text.split()).rstrip('.')
        default = value.value if isinstance(value, ast.Constant) else None
        shown = words[:1].lower() + words[1:]
        declared[name] = kind.removesuffix(' | None'), default, shown
    return declared


class _Joined(argparse.Action):
    """Joins values that are typed in several places; those of a ``const`` option give way."""

    def __call__(self, _: Any, to: argparse.Namespace, values: Any, _flag: Any = None) -> None:
        """Add the values."""
        old = getattr(to, self.dest) or type(values)()
        if isinstance(values, list):
            values = old + values
        else:
            values = values | old if self.const else old | values
        setattr(to, self.dest, values)


def _late(name: str) -> Callable[..., Any]:
    """Return a function, imported when it is called, whose refusals argparse does not rewrite."""
    module, _, function = name.rpartition('.')

    def call(*given: Any) -> Any:
        try:
            return getattr(import_module(f'stickslip_ros.{module}'), function)(*given)
        except StickSlipError as error:  # of some argparse would make a line of its own
            raise StickSlipError(str(error)) from None

    return call


def _to_mapping(form: str, text: str) -> Any:
    return _late('parameters.parse_assignments')([text], form)


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


_JOINED: dict[str, Any] = {'action': _Joined}
_FORMS: dict[str, tuple[Callable[[str, str], Any], str, str, dict[str, Any]]] = {
    'Table': (lambda _, text: to_path(text), 'FILE', '', {}),
    'tuple[float, float]': (
        lambda _, text: _late('lab.runs.recorded.parse_window')(text),
        'LENGTH@START',
        ': 2ms@0.3s is 2 ms from 0.3 s on (default: the whole run)',
        {},
    ),
    'Mapping[str, str]': (
        _to_mapping,
        'NAME=HEADER',
        ', as force_n="Force (mN)" or position_m=/rig/encoder.point.x; may be repeated',
        _JOINED,
    ),
    'float | str': (_to_mapping, 'NAME=VALUE', '; may be repeated', _JOINED),
    'Known | str': (
        _to_mapping,
        'NAME=VALUE+-SHARE',
        ', as runner.mass=3g+-1%%; may be repeated',
        _JOINED,
    ),
    'Sequence[float]': (
        lambda form, text: _late('lab.cli.chosen.to_numbers')(form.split()[0], text, 'N'),
        'NEWTONS',
        ', with commas; may be repeated',
        _JOINED,
    ),
}
"""By the annotation of a field: how it is read from an example and a text, how it is shown."""
READING = 'experiments.options.ReadingOptions'
[WORKERS] = options_of(READING, 'workers')
[WINDOW] = options_of(READING, 'window_s')
MAP = (
    *options_of(READING, 'headers'),
    option(
        '--map-file',
        'YAML file of these names and headers; --map wins',
        _late('lab.cli.experiment.read_headers'),
        'FILE',
        dest='headers',
        action=_Joined,
        const=True,
    ),
)
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
