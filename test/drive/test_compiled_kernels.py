# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Compiled or not, the kernels compute the same bits."""

import json
import os
import sys
from pathlib import Path

from processes import run_process
from short_run import all_runs


def test_compiled_and_interpreted_kernels_give_the_same_bits():
    finished = run_process(
        [sys.executable, Path(__file__).with_name('short_run.py')],
        env=os.environ | {'NUMBA_DISABLE_JIT': '1'},
        check=True,
    )
    assert json.loads(finished.stdout) == {'interpreted': True, 'run': all_runs()}
