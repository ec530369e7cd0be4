"""``stickslip compile``: compiles the kernels beforehand."""

import argparse
import sys
import time
from typing import Any

from stickslip_ros.cli.common import add_json, print_json
from stickslip_ros.contact.kernel import compilation_reported
from stickslip_ros.contact.kernel_cache import cache_folders
from stickslip_ros.instrument.compilation import compile_kernels, progress_reporter

NOT_KEPT = 1


def add_verb(add_parser: Any) -> None:
    """Add the verb to the parser."""
    parser = add_parser(
        'compile',
        description='Compile the kernels of the drive and keep them on the disk, as part of an '
        'installation. What root has compiled, every user of the machine may read. Exit status 1 '
        'if there is no folder to keep them in.',
    )
    parser.add_argument(
        '--timings', action='store_true', help='print how many were compiled, and the time'
    )
    add_json(parser)
    parser.set_defaults(run=run, tells_compilation=True)


def run(arguments: argparse.Namespace) -> int:
    """Compile; say something only where there is something to do."""
    compiled = 0
    report = progress_reporter(lambda line: print(line, file=sys.stderr, flush=True))

    def count(done: int) -> None:
        nonlocal compiled
        compiled = done + 1
        report(done)

    start_s, start_cpu_s = time.perf_counter(), time.process_time()
    with compilation_reported(count):
        compile_kernels()
    wall_s, processor_s = time.perf_counter() - start_s, time.process_time() - start_cpu_s
    folder = cache_folders().write
    if arguments.json:
        kept = str(folder) if folder else None
        print_json(
            {'kernels': compiled, 'wall_s': wall_s, 'processor_s': processor_s, 'folder': kept}
        )
    elif arguments.timings or compiled:
        print(f'{compiled} kernels compiled in {wall_s:.1f} s, {processor_s:.1f} s of a processor')
    if compiled and folder is None:
        return NOT_KEPT
    return 0
