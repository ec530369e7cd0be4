# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""``stickslip compile``: compile the kernels beforehand."""

import argparse
import sys
import time

from stickslip_ros.instrument.compilation import compile_kernels, progress_reporter
from stickslip_ros.kernels.cache import cache_folders
from stickslip_ros.kernels.kernel import compilation_reported
from stickslip_ros.lab.cli.printing import CHECK_FAILED, Answer
from stickslip_ros.lab.runs.courses import compile_for_runs


def compile_verb(_: argparse.Namespace) -> Answer:
    """Compile; print a line only if kernels were compiled."""
    compiled = 0
    report = progress_reporter(lambda line: print(line, file=sys.stderr, flush=True))

    def count(done: int) -> None:
        nonlocal compiled
        compiled = done + 1
        report(done)

    start_s, start_cpu_s = time.perf_counter(), time.process_time()
    with compilation_reported(count):
        compile_kernels()
        compile_for_runs()
    wall_s, processor_s = time.perf_counter() - start_s, time.process_time() - start_cpu_s
    folder = cache_folders().write
    content = {
        'kernels': compiled,
        'wall_s': wall_s,
        'processor_s': processor_s,
        'folder': str(folder) if folder else None,
    }
    line = f'{compiled} kernels compiled in {wall_s:.1f} s, {processor_s:.1f} s of a processor'
    status = CHECK_FAILED if compiled and folder is None else 0
    return Answer(content, [line] if compiled else [], status)
