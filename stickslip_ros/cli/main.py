"""The parser of ``stickslip``, and what becomes of a command line."""

import argparse
import os
import re
import sys
from collections.abc import Collection, Iterator, Sequence
from contextlib import contextmanager
from importlib import import_module
from typing import TYPE_CHECKING

import stickslip_ros
from stickslip_ros.cli.program import REFUSED
from stickslip_ros.errors import StickSlipError
from stickslip_ros.ros.ending import STOPPED
from stickslip_ros.stopping import Stopped, heed_stop

if TYPE_CHECKING:
    from stickslip_ros.cli.options import Verb

VERBS = {
    'contact': 'indentation, contact radius and presliding of one hemisphere',
    'simulate': 'drive the stand with a saw-tooth and report force and step length',
    'sweep': 'run the drive at every combination of values and write a table',
    'zero-amplitude': 'find the stroke below which a free runner makes no steps',
    'bode': 'frequency response of the stuck drive, in closed form and by swept sine',
    'import': 'read tables of instruments and spreadsheets, and write them in our form',
    'compare': 'compare runs, sweeps, experiments and the model',
    'fit': 'fit parameters of the drive to measured forces, with error bars',
    'drive': 'run the ROS 2 node (needs rclpy)',
    'demo': 'run the node, command it over topics, record, summarise, draw (needs rclpy)',
    'positioning': 'let the position controller drive to targets, record, draw (needs rclpy)',
    'panel': 'serve the front panel of a drive or of a recording to a browser',
    'info': 'topics, counts, rates, gaps and parameters of a recording',
    'plot': 'draw position, force, voltage and foot of a recording against time',
    'recover': 'make an unfinished, cut or damaged recording readable again',
    'replay': 'run a recording again, or drive the stand with a measured voltage',
    'roughness': 'compare random rough lines with the equivalent profile',
    'laws': 'generated force of every profile and friction law over amplitude and preload',
    'figures': "simulate the paper's figures, and what it leaves open",
    'validate': 'check the contact mechanics against closed forms, springs and 3-D solutions',
    'parameters': 'print all parameters with units and sources as a ROS parameter file',
    'interface': 'print topics, services, events and parameters as a page of documentation',
    'compile': 'compile the kernels now, so that the first run need not',
}
"""What each verb does; its module is imported when it is asked for."""
MODULES = {
    'import': 'measurement',
    'zero-amplitude': 'sweep',
    'positioning': 'demo',
    **dict.fromkeys(('info', 'plot', 'recover'), 'recording'),
    **dict.fromkeys(('roughness', 'laws', 'figures'), 'paper'),
    **dict.fromkeys(('parameters', 'interface'), 'reference'),
}
"""Where verbs share a module; the others have one of their name."""
NEGATIVE_NUMBER = re.compile(r'-(\d+\.?\d*|\.\d+)(e[-+]?\d+)?|-inf|-nan', re.IGNORECASE)

DESCRIPTION = """\
A virtual stick-slip microdrive: rough-contact mechanics, drive, sensors, ROS 2 node.

All numbers are in SI units (metres, newtons, volts, seconds): 60 nm is 60e-9.
"""
EPILOGUE = """\
examples:
  stickslip contact --normal-force 0.2 --curve 0.1,0.5,0.9
  stickslip roughness --out runs --realisations 100 --set contact.hurst=0.8
  stickslip simulate --preload 0.25 --amplitude 60e-9 --frequency 500 --steps 400
  stickslip simulate --voltage 300 --frequency 1000 --free -o runs/free.mcap
  stickslip sweep --preload 0.1,0.5,1.0 --amplitude 0:160e-9:33 -o runs/force.csv
  stickslip zero-amplitude --preload 0.5 --frequency 200
  stickslip bode --figure runs/bode.png -o runs/bode.csv
  stickslip fit experiment.csv --free contact.friction,runner.damping --start runner.damping=50
  stickslip drive --set stand.preload=0.25
  stickslip demo
  stickslip positioning --params config/realistic.yaml
  stickslip panel runs/demo.mcap
  stickslip info runs/demo.mcap
  stickslip plot runs/demo.mcap --window 2ms@0.1s
  stickslip import scope.csv --map voltage_v="CH1 (V)" -o runs/voltage.csv
  stickslip compare experiment.csv model --report runs/comparison.html
  stickslip recover runs/cut_off.mcap
  stickslip replay runs/free.mcap --set stand.preload=0.25 -o runs/what_if.mcap
  stickslip validate --out runs/validation
  stickslip figures --out runs/figures --only fig2,fig7
  stickslip compile --timings

'stickslip VERB --help' explains a verb. Exit status: 0 done, 1 a check failed, 2 refused,
130 stopped by Ctrl-C or SIGTERM, which end the node (drive) with 0.
"""


def build_parser(asked: Collection[str] = VERBS) -> argparse.ArgumentParser:
    """Return the parser, which knows all verbs by name and the arguments of those asked for."""
    parser = argparse.ArgumentParser(
        prog='stickslip',
        description=DESCRIPTION,
        epilog=EPILOGUE,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument('--version', action='version', version=stickslip_ros.__version__)
    verbs = parser.add_subparsers(title='verbs', metavar='VERB', required=True)
    for name, summary in VERBS.items():
        parser_of_verb = verbs.add_parser(name, help=summary)
        if name in asked:
            verb_of(name).fill(parser_of_verb)
    return parser


def verb_of(name: str) -> 'Verb':
    """Import the module of a verb and return what it declares."""
    module = import_module(f'stickslip_ros.cli.{MODULES.get(name, name)}')
    verb: Verb = getattr(module, f'{name.replace("-", "_")}_verb')
    return verb


def main(arguments: Sequence[str] | None = None) -> int:
    """
    Run a verb.

    Without arguments, the words behind ``stickslip``, those of the command line are taken. Return
    the exit status: 0 done, 1 a check failed, 2 refused, 130 stopped.

    """
    words = _join_negative_numbers(sys.argv[1:] if arguments is None else arguments)
    try:
        heed_stop()
        parsed = _parse(words)
        heed_stop()
        with _compilation_reported(parsed):
            answer = parsed.verb.run(parsed)
            answer.show(as_json=parsed.json)
        sys.stdout.flush()
    except Stopped as stopped:
        sys.stderr.write(f'stickslip: {stopped}\n')
        return STOPPED
    except KeyboardInterrupt:
        sys.stderr.write('stickslip: stopped\n')
        return STOPPED
    except StickSlipError as error:
        sys.stderr.write(f'stickslip: {error}\n')
        return REFUSED
    except BrokenPipeError:  # the reader, such as head, has seen enough
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    except OSError as error:
        name = f'{error.filename}: ' if error.filename else ''
        sys.stderr.write(f'stickslip: {name}{error.strerror}; choose another path\n')
        return REFUSED
    return int(answer.status)


def _parse(words: Sequence[str]) -> argparse.Namespace:
    parser = build_parser(words[:1])
    parsed, rest = parser.parse_known_args(words)
    if rest and not (parsed.verb.takes_ros_arguments and rest[0] == '--ros-args'):
        parser.error(f'unrecognized arguments: {" ".join(rest)}')
    parsed.ros_arguments, parsed.words = rest, words
    return parsed


@contextmanager
def _compilation_reported(parsed: argparse.Namespace) -> Iterator[None]:
    """Say that a verb compiles, unless it has no kernels or says so itself."""
    if 'numba' not in sys.modules or parsed.verb.reports_compilation:
        yield
        return
    # ruff: noqa: PLC0415 - most verbs do without
    from stickslip_ros.contact.kernel import compilation_reported
    from stickslip_ros.contact.kernel_cache import why_not_kept

    def report(done: int) -> None:
        line = why_not_kept() or ('compiling kernels, once' if sys.stderr.isatty() else '')
        if done == 0 and line:
            sys.stderr.write(f'stickslip: {line}\n')

    with compilation_reported(report):
        yield


def _join_negative_numbers(words: Sequence[str]) -> list[str]:
    """Return ``--frequency -1e3`` as ``--frequency=-1e3``, which argparse understands."""
    joined: list[str] = []
    for word in words:
        follows_option = bool(joined) and joined[-1].startswith('--') and '=' not in joined[-1]
        if follows_option and NEGATIVE_NUMBER.fullmatch(word):
            joined[-1] += f'={word}'
        else:
            joined.append(word)
    return joined
