# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Print what each stand loads after ``compile_for``, as JSON, each in a process of its own."""

import json
import os
from typing import Any

from bench_runs import MS
from test_compilation import REQUESTS, STANDS, parameters_of

from stickslip_ros.instrument.bench import Bench
from stickslip_ros.instrument.compilation import compile_for, needs_all_kernels
from stickslip_ros.kernels.cache import KernelCache

loaded: list[str] = []
_load = KernelCache.load_overload


def load_and_note(self: KernelCache, sig: Any, target_context: Any) -> Any:
    """Load a kernel, and note its name; a kernel that is not on the disk is compiled."""
    loaded.append(self._function.__name__)
    return _load(self, sig, target_context)


def run(name: str) -> dict[str, object]:
    """Return the names of the kernels that a stand loads while it runs."""
    parameters = parameters_of(name)
    can_do_all = compile_for(parameters)
    before = loaded.copy()
    bench = Bench(parameters)
    for request in REQUESTS:
        if can_do_all or not needs_all_kernels(request):
            bench.update(bench.time_ns + MS, [request])
    late = loaded[len(before) :]
    bench.update(bench.time_ns + MS, [REQUESTS[5], REQUESTS[6], REQUESTS[8]])
    further = len(loaded) - len(before) - len(late)
    return {'can_do_all': can_do_all, 'before': before, 'late': late, 'further': further}


if __name__ == '__main__':
    KernelCache.load_overload = load_and_note  # type: ignore[method-assign]
    for each in STANDS:
        if not os.fork():
            os.write(1, json.dumps({each: run(each)}).encode() + b'\n')
            os._exit(0)
        os.wait()
