"""The parser of ``stickslip``, and what becomes of a command line."""

import argparse
import os
import re
import sys
from collections.abc import Callable, Sequence

import stickslip_ros
from stickslip_ros.cli import (
    compare,
    contact,
    demo,
    drive,
    figures,
    fit,
    info,
    interface,
    laws,
    parameters,
    plot,
    positioning,
    recover,
    replay,
    roughness,
    simulate,
    sweep,
    validate,
    zero_amplitude,
)
from stickslip_ros.cli import compile as compilation
from stickslip_ros.cli.program import REFUSED
from stickslip_ros.contact.kernel import compilation_told
from stickslip_ros.contact.kernel_cache import why_not_kept
from stickslip_ros.errors import StickSlipError
from stickslip_ros.ros.ending import STOPPED
from stickslip_ros.stopping import heed_stop
from stickslip_ros.study.batch import Interrupted

VERBS = (
    contact,
    simulate,
    sweep,
    zero_amplitude,
    compare,
    fit,
    drive,
    demo,
    positioning,
    info,
    plot,
    recover,
    replay,
    roughness,
    laws,
    figures,
    validate,
    parameters,
    interface,
    compilation,
)
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
  stickslip fit experiment.csv --free contact.friction,runner.damping --start runner.damping=50
  stickslip drive --set stand.preload=0.25
  stickslip demo
  stickslip positioning --params config/realistic.yaml
  stickslip info runs/demo.mcap
  stickslip plot runs/demo.mcap --window 2ms@0.1s
  stickslip compare experiment.csv model --report runs/comparison.html
  stickslip recover runs/cut_off.mcap
  stickslip replay runs/free.mcap --set stand.preload=0.25 -o runs/what_if.mcap
  stickslip validate --out runs/validation
  stickslip figures --out runs/figures --only fig2,fig7
  stickslip compile --timings

'stickslip VERB --help' explains a verb. Exit status: 0 done, 1 a check failed, 2 refused,
130 stopped by Ctrl-C or SIGTERM, which end the node (drive) with 0.
"""


def build_parser() -> argparse.ArgumentParser:
    """Return the parser with all verbs."""
    parser = argparse.ArgumentParser(
        prog='stickslip',
        description=DESCRIPTION,
        epilog=EPILOGUE,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument('--version', action='version', version=stickslip_ros.__version__)
    verbs = parser.add_subparsers(title='verbs', metavar='VERB', required=True)
    for verb in VERBS:
        verb.add_verb(verbs)
    return parser


def main(arguments: Sequence[str] | None = None) -> int:
    """
    Run a verb.

    Parameters
    ----------
    arguments : sequence of str, optional
        Words behind ``stickslip``; the command line if None.

    Returns
    -------
    int
        Exit status: 0 done, 1 a check failed, 2 refused, 130 stopped.

    """
    words = _join_negative_numbers(sys.argv[1:] if arguments is None else arguments)
    try:
        heed_stop()
        parsed = _parse(words)
        with compilation_told(_tell_compilation_of(parsed)):
            status = int(parsed.run(parsed))
        sys.stdout.flush()
    except Interrupted as stopped:
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
    return status


def _parse(words: Sequence[str]) -> argparse.Namespace:
    parser = build_parser()
    parsed, rest = parser.parse_known_args(words)
    if rest and not (getattr(parsed, 'takes_ros_arguments', False) and rest[0] == '--ros-args'):
        parser.error(f'unrecognized arguments: {" ".join(rest)}')
    parsed.ros_arguments = rest
    return parsed


def _tell_compilation_of(parsed: argparse.Namespace) -> Callable[[int], None]:
    """Return what says that a verb compiles, unless it says so itself."""

    def tell(done: int) -> None:
        line = why_not_kept() or ('compiling kernels, once' if sys.stderr.isatty() else '')
        if done == 0 and line and parsed.run not in (compilation.run, drive.run):
            sys.stderr.write(f'stickslip: {line}\n')

    return tell


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
