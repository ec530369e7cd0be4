# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The parser of ``stickslip``: it reads and completes command lines."""

import argparse
import difflib
import json
import os
import re
import sys
from collections.abc import Collection, Iterable, Iterator, Sequence
from contextlib import contextmanager
from itertools import takewhile
from typing import Any, NoReturn

import stickslip_ros
from stickslip_ros.errors import StickSlipError, printable
from stickslip_ros.extras import needs_ros
from stickslip_ros.lab.cli.verbs import GROUPS, VERBS
from stickslip_ros.process.signals import REFUSED, STOPPED, begin
from stickslip_ros.process.stopping import Stopped
from stickslip_ros.units import joined

# ruff: noqa: PLC0415 - most verbs do not need these imports

NEGATIVE = re.compile(r'-(\.?\d|inf|nan).*', re.IGNORECASE)
ROS_ARGS = '--ros-args'
OF_PARAMETERS = ('GROUP.NAME=', 'NAME=VALUE', 'NAME=LOW', 'NAMES')
"""Metavars of values that begin with the name of a parameter."""
USAGE = 'stickslip [-h] [--version] VERB ...'
DESCRIPTION = """\
A virtual stick-slip microdrive: rough-contact mechanics, drive, sensors, ROS.

Quantities are typed with their units, as 60nm, 250mN, 150V/us or 1kHz; plain
numbers are in SI units: 60e-9.
"""
EPILOGUE = """\
examples:
  stickslip simulate --amplitude 60nm --preload 250mN --frequency 500Hz
  stickslip simulate --voltage 300V --no-load-cell -o free.mcap
  stickslip sweep --preload 0.1,0.5 --amplitude 0:160nm:33 -o force.csv
  stickslip import scope.csv --map voltage_v="CH1 (V)" -o voltage.csv
  stickslip fit experiment.csv --free contact.friction,runner.damping
  stickslip compare experiment.csv model -o comparison.html
  stickslip plot free.mcap --window 3ms@30ms
  stickslip drive --set stand.preload=250mN

'stickslip VERB --help' explains a verb. Exit status: 0 done, 1 a check failed,
2 refused, 130 stopped by Ctrl-C, SIGTERM or SIGHUP; a node (drive, twin) ends
with 0 then.
"""


class LineParser(argparse.ArgumentParser):
    """A parser that refuses in one line."""

    def error(self, message: str) -> NoReturn:
        """Refuse a command line without printing its usage."""
        hint = '' if message.endswith('?') else f"; '{self.prog} --help' explains it"
        raise StickSlipError(message + hint)


class VerbParser(LineParser):
    """A parser that suggests options for a mistyped option before it misses others."""

    def __init__(self, *given: Any, **named: Any) -> None:
        super().__init__(*given, **named)
        self._negative_number_matcher = NEGATIVE  # -1kHz too is a value, no option

    def parse_known_args(self, args: Any = None, namespace: Any = None) -> Any:
        """Refuse unknown options, then parse as argparse does."""
        for word in takewhile(lambda word: word not in {'--', ROS_ARGS}, args):
            flag, known = word.partition('=')[0], self._option_string_actions
            if flag.startswith('--') and not any(each.startswith(flag) for each in known):
                self.error(f'unrecognized arguments: {flag}{meant(flag, known)}')
        return super().parse_known_args(args, namespace)


def meant(word: str, known: Collection[str]) -> str:
    """Return the end of a message that suggests known words."""
    near = difflib.get_close_matches(word, known, n=2, cutoff=0.7)
    return f'; did you mean {" or ".join(near)}?' if near else ''


def build_parser(asked: Collection[str] = VERBS) -> argparse.ArgumentParser:
    """Return the parser with all verbs, and with the options of the verbs asked for."""
    listed = '\n\n'.join(
        f'{title}:\n' + '\n'.join(f'  {verb.name:<16}{verb.summary}' for verb in group)
        for title, group in GROUPS.items()
    )
    parser = LineParser(
        prog='stickslip',
        usage=USAGE,
        description=f'{DESCRIPTION}\n{listed}',
        epilog=EPILOGUE,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument('--version', action='version', version=stickslip_ros.__version__)
    verbs = parser.add_subparsers(
        prog='stickslip',
        parser_class=VerbParser,
        metavar='VERB',
        required=True,
        help=argparse.SUPPRESS,
    )
    for verb in VERBS.values():
        parser_of_verb = verbs.add_parser(verb.name, help=verb.summary)
        if verb.name in asked:
            verb.fill(parser_of_verb)
    return parser


def main(arguments: Sequence[str] | None = None) -> int:
    """
    Run a verb with the given words, by default those of the command line.

    Return the exit status: 0 done, 1 a check failed, 2 refused, 130 stopped.

    """
    words = sys.argv[1:] if arguments is None else arguments
    try:
        parsed = _parse(words)
        with needs_ros(f'stickslip {parsed.verb.name}'):
            run_verb = parsed.verb.load()
            begin()
            with _compilation_reported(parsed):
                answer = run_verb(parsed)
                answer.show(as_json=parsed.json)
        sys.stdout.flush()
        return int(answer.status)
    except Stopped as stopped:
        sys.stderr.write(f'stickslip: {stopped}\n')
        return STOPPED
    except KeyboardInterrupt:
        sys.stderr.write('stickslip: stopped\n')
        return STOPPED
    except StickSlipError as error:
        sys.stderr.write(f'stickslip: {error}\n')
        _show_table(getattr(error, 'table', ()), words)
        return getattr(error, 'status', REFUSED)
    except BrokenPipeError:  # the reader, such as head, has seen enough
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    except OSError as error:
        name = f'{printable(str(error.filename))}: ' if error.filename else ''
        sys.stderr.write(f'stickslip: {name}{error.strerror}; choose another path\n')
        return REFUSED


def _show_table(table: Sequence[Sequence[str]], words: Sequence[str]) -> None:
    """Print the table of a refusal below its line, or as JSON to stdout."""
    if '--json' in words and table:
        columns = [dict(zip(table[0], row, strict=True)) for row in table[1:]]
        print(json.dumps({'columns': columns}, indent=2))
        return
    widths = [max(map(len, column)) for column in zip(*table, strict=True)]
    for row in table:
        line = '  '.join(cell.ljust(width) for cell, width in zip(row, widths, strict=True))
        sys.stderr.write(f'  {printable(line)}\n'.rstrip(' '))


def _parse(typed: Sequence[str]) -> argparse.Namespace:
    words = joined(typed)
    parser = build_parser(words[:1])
    if words and words[0] not in VERBS and not words[0].startswith('-'):
        parser.error(f'verb {words[0]!r} is not known{meant(words[0], VERBS)}')
    parsed, rest = parser.parse_known_args(words)
    if rest and not (parsed.verb.takes_ros_arguments and rest[0] == ROS_ARGS):
        parser.error(f'unrecognized arguments: {" ".join(rest)}')
    parsed.ros_arguments, parsed.words = rest, words
    return parsed


@contextmanager
def _compilation_reported(parsed: argparse.Namespace) -> Iterator[None]:
    """Report that a verb compiles, unless it has no kernels or reports this itself."""
    if 'numba' not in sys.modules or parsed.verb.reports_compilation:
        yield
        return
    from stickslip_ros.instrument.compilation import progress_reporter
    from stickslip_ros.kernels.cache import cache_problem
    from stickslip_ros.kernels.kernel import compilation_reported

    def say(line: str) -> None:
        sys.stderr.write(f'stickslip: {line}\n')

    def report_problem(done: int) -> None:
        if done == 0 and (line := cache_problem()):
            say(line)

    report = progress_reporter(say) if sys.stderr.isatty() else report_problem
    with compilation_reported(report):
        yield


def complete() -> None:
    """Print completions for bash or zsh, and end the process."""
    from argcomplete import autocomplete

    parser = build_parser(os.environ['COMP_LINE'].split()[1:2])
    autocomplete(parser, always_complete_options='long', default_completer=values_of)  # type: ignore[arg-type]


def values_of(*, prefix: str, action: argparse.Action, **_: object) -> Iterable[str]:
    """Return the possible values of an option: files, stages, parameters, their choices."""
    shown = str(action.metavar)
    if shown in {'FILE', 'DIR'}:
        from argcomplete.completers import FilesCompleter

        return list(FilesCompleter()(prefix))
    if shown == 'STAGE':
        from stickslip_ros.parameters.stages import stage_files

        return stage_files()
    if not shown.startswith(OF_PARAMETERS):
        return []
    from stickslip_ros.parameters import specs

    name, equals, _typed = prefix.partition('=')
    if equals:
        return [f'{name}={each}' for each in specs()[name].choices] if name in specs() else []
    others, comma, _typed = prefix.rpartition(',')
    return [f'{others}{comma}{name}{"=" * ("=" in shown)}' for name in specs()]
