# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Verbs and their options, without slow imports: help, completion and refusals need none."""

import argparse
import itertools
import re
from collections.abc import Callable, Iterable
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
FLAGS = {'headers': '--map', 'preloads_n': '--preload', 'slope_deg': '--slope'}
"""Flags that differ from the name of their field."""
Option = Callable[[Any], object]
"""An option adds itself to a parser of argparse or to one of its groups."""


class Verb(NamedTuple):
    """A verb of ``stickslip``."""

    name: str
    summary: str
    description: str
    options: tuple[Option, ...]
    module: str  # module of this package with ``<name>_verb``, which makes the answer
    reports_compilation: bool = False  # whether the verb reports a compilation itself
    takes_ros_arguments: bool = False  # whether ``--ros-args`` may follow

    def fill(self, parser: argparse.ArgumentParser) -> None:
        parser.description = self.description
        for add in (*self.options, flag_option('--json', 'print one JSON object, SI units')):
            add(parser)
        parser.set_defaults(verb=self)

    def load(self) -> 'Callable[[argparse.Namespace], Answer]':
        """Import the function that makes the answer."""
        module: Any = import_module(f'stickslip_ros.lab.cli.{self.module}')
        return getattr(module, f'{self.name.replace("-", "_")}_verb')  # type: ignore[no-any-return]


def verb(
    name: str, summary: str, description: str, *options: Option, module: str = '', **traits: bool
) -> Verb:
    """Return a verb; by default its module has the same name."""
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
    Return an option, as ``-o --output``, or an argument, without dashes.

    The text becomes its help, followed by the default. With a ``unit`` it is a quantity. Without a
    ``metavar`` a path is shown as FILE, a whole number as N; ``more`` goes to argparse.

    """
    default = more.get('default')
    if default and 'default: ' not in text:
        text += ' (default: %(default)s)'
    if metavar is None and (flags.startswith('-') or kind is to_path):
        metavar = {to_path: 'FILE', int: 'N'}.get(kind) or unit.upper() or None
    if unit or kind in {int, float}:
        flag = flags.rsplit(maxsplit=1)[-1]
        form = 'declaration.to_int' if kind is int else 'typed.to_si'
        kind = lambda text: _late(f'parameters.{form}')(flag, text, unit)  # noqa: E731
    if kind is not None:
        more['type'] = kind
    return lambda to: to.add_argument(*flags.split(), metavar=metavar, help=text, **more)


def options_of(owner: str, *names: str) -> tuple[Option, ...]:
    """
    Return options for arguments of a function or fields of a record, as ``runs.sweep.sweep``.

    Name, annotation, default and documentation give flag, unit, kind and help, see ``_FORMS``. The
    source is read, as its import would be slow. An option that is not given is None.

    """
    return tuple(partial(_add_declared, owner, name) for name in names)


def _add_declared(owner: str, name: str, to: Any) -> object:
    kind, default, text = _declared(owner)[name]
    ending = next((each for each in UNITS if name.endswith(f'_{each}')), '')
    stem, unit = name.removesuffix(f'_{ending}'), UNITS.get(ending, '')
    flag = FLAGS.get(name, f'--{stem}'.replace('_', '-'))
    text = text.removesuffix(f', {unit}').replace('%', '%%')
    if kind == 'bool':
        return flag_option(flag, text, dest=name)(to)
    if default:
        text += f' (default: {default:g}{unit})'
    if kind not in _FORMS:
        number = {'int': int, 'float': float}.get(kind)
        return option(flag, text, number, unit=unit, dest=name)(to)
    metavar, hint, convert = _FORMS[kind]
    form = f'{flag} {metavar}'
    convert = convert or (lambda typed: _late('parameters.parse_assignments')([typed], form))
    action = _Joined if hint.endswith(_REPEATED) else 'store'
    return option(flag, text + hint, convert, metavar, dest=name, action=action)(to)


@cache
def _declared(owner: str) -> dict[str, tuple[str, Any, str]]:
    """Return annotation, default and documentation of arguments or fields from the source."""
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
    """Joins the values of repeated options."""

    def __call__(self, _: Any, to: argparse.Namespace, values: Any, _flag: Any = None) -> None:
        old = getattr(to, self.dest) or type(values)()
        setattr(to, self.dest, old + values if isinstance(values, list) else old | values)


class _First(argparse.Action):
    """Puts its value before those of the other options of its name."""

    def __call__(self, _: Any, to: argparse.Namespace, values: Any, _flag: Any = None) -> None:
        setattr(to, self.dest, [values, *getattr(to, self.dest)])


def _late(name: str) -> Callable[..., Any]:
    """Return a function that is imported when called, with refusals that argparse keeps."""
    module, _, function = name.rpartition('.')

    def call(*given: Any) -> Any:
        try:
            return getattr(import_module(f'stickslip_ros.{module}'), function)(*given)
        except StickSlipError as error:  # argparse would replace those that are ValueErrors
            raise StickSlipError(str(error)) from None

    return call


def to_node(text: str, flag: str = '--node') -> str:
    """Return a name as ROS allows it; refuse other characters."""
    if not re.fullmatch(r'([a-z_]\w*)?', text, re.ASCII | re.IGNORECASE):
        why = f'{flag} {quoted(text)} is not made of letters, digits and _'
        raise StickSlipError(f'{why}; give a name such as left')
    return text


def to_namespace(text: str) -> str:
    """Return a namespace in the form of ROS."""
    return ''.join(f'/{to_node(each, "--namespace")}' for each in text.split('/') if each)


def many(flags: str, text: str, metavar: str, kind: Any = str, **more: Any) -> Option:
    """Return an option that may be repeated."""
    return option(
        flags, f'{text}; may be repeated', kind, metavar, action='append', default=[], **more
    )


def flag_option(flag: str, text: str, **more: Any) -> Option:
    """Return an option without a value; with ``const`` and ``dest`` it sets that value."""
    action = 'store_const' if 'const' in more else 'store_true'
    return lambda to: to.add_argument(flag, action=action, help=text, **more)


def either(*options: Option, required: bool = False) -> Option:
    """Return options that exclude each other."""
    return _grouped(options, lambda to: to.add_mutually_exclusive_group(required=required))


def titled(title: str, *options: Option) -> Option:
    """Return options under a title of their own."""
    return _grouped(options, lambda to: to.add_argument_group(title))


def _grouped(options: Iterable[Option], group_in: Callable[[Any], Any]) -> Option:
    def add(to: Any) -> None:
        group = group_in(to)
        for each in options:
            each(group)

    return add


def to_path(text: str) -> 'Path':
    """Return a path as typed; ``.`` and ``..``, which have no name, are resolved."""
    from pathlib import Path

    from stickslip_ros.errors import RecordingError

    if text in {'', '-'}:
        raise RecordingError(repr(text), 'is not the name of a file', 'give a path')
    path = Path(text)
    return path if path.name not in {'', '..'} else path.resolve()


def file(text: str, **more: Any) -> Option:
    """Return the argument for the files that a verb reads."""
    name = 'files' if more.get('nargs') == '+' else 'file'
    return option(name, text, to_path, **more)


def output(text: str, **more: Any) -> Option:
    """Return the option for the file that a verb writes."""
    return option('-o --output', text, to_path, **more)


def folder(default: str = 'runs') -> Option:
    """Return the option for the folder that a verb writes to."""
    return output('folder to write into', metavar='DIR', default=default)


_REPEATED = '; may be repeated'
_EXAMPLES = ', as force_n="Force (mN)" or position_m=/rig/encoder.point.x'
_FORMS: dict[str, tuple[str, str, Callable[[str], Any] | None]] = {
    'Table': ('FILE', '', to_path),
    'tuple[float, float]': (
        'LENGTH@START',
        ': 2ms@0.3s is 2 ms from 0.3 s on (default: the whole run)',
        _late('lab.measurements.recorded.parse_window'),
    ),
    'Mapping[str, str]': ('NAME=HEADER', _EXAMPLES + _REPEATED, None),
    'float | str': ('NAME=VALUE', _REPEATED, None),
    'KnownValue | str': ('NAME=VALUE+-SHARE', ', as runner.mass=3g+-1%%' + _REPEATED, None),
    'Mapping[str, KnownValue | str]': (
        'NAME=VALUE+-SHARE',
        ', as contact.radius=0.5mm+-2%% or scale=+-30%%' + _REPEATED,
        None,
    ),
    'Sequence[float]': (
        'NEWTONS',
        ', with commas' + _REPEATED,
        lambda text: _late('lab.cli.chosen.to_numbers')('--preload', text, 'N'),
    ),
}
"""By the annotation of a field: metavar, end of the help, converter (None: an assignment)."""
READING = 'experiments.options.ReadingOptions'
[WORKERS] = options_of(READING, 'workers')
[WINDOW] = options_of(READING, 'window_s')
MAP = options_of(READING, 'headers')
LOOK = (
    option(
        '--style',
        'style of the figure: screen; paper (85 mm wide, letters of 8 pt); a file NAME.mplstyle',
        metavar='STYLE',
        default='',
    ),
    option(
        '--width',
        'width of the figure, as 170mm; implies --style paper',
        unit='m',
        metavar='WIDTH',
    ),
)
FIGURE = (option('--figure', 'draw a figure: .png, .svg or .pdf', to_path), *LOOK)
DRAWS = option(
    '--draws',
    'a fit (.json of stickslip fit): use its stand, and add bands of its uncertainty',
    to_path,
)
PARAMETERS = (
    many(
        '--params',
        'ROS parameter file, as config/test_stand.yaml; later files win',
        'FILE',
        to_path,
    ),
    option(
        '--stage',
        'another kind of stage, a file of config/stages, as clamp; --params wins over it',
        _late('parameters.stages.stage_file'),
        'STAGE',
        dest='params',
        action=_First,
        default=[],
    ),
    many(
        '--set',
        'set one parameter, as stand.preload=250mN; wins over --params',
        'GROUP.NAME=VALUE',
        dest='assignments',
    ),
)
"""Options that choose a stand, as does an option with the name of a parameter as ``dest``."""
NAMESPACE = option(
    '--namespace', 'namespace of the drive, as /left', to_namespace, 'NAME', default=''
)
NODE = option(
    '--node', 'its node (default: the only drive in the namespace)', to_node, 'NAME', default=''
)
PRELOAD = option('--preload', 'set stand.preload', metavar='NEWTON', dest='stand.preload')
NO_LOAD_CELL = flag_option(
    '--no-load-cell',
    'free the runner: set load_cell.contact=absent',
    dest='load_cell.contact',
    const='absent',
)
