# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""A process that another has started ends with it, even where that is killed."""

import subprocess
import sys
from pathlib import Path

from processes import finish, start_process

DEMO = """
import sys
from pathlib import Path
from stickslip_ros.lab.cli import demo
sys.executable = sys.argv[1]
with demo._drive_process(Path('settings.yaml'), 1) as drive:
    drive.wait()
"""


def test_the_drive_of_a_killed_demo_ends(tmp_path: Path):
    drive = tmp_path / 'drive'
    drive.write_text('#!/bin/sh\necho started\nexec sleep 300\n')
    drive.chmod(0o700)
    demo = start_process([sys.executable, '-c', DEMO, drive], stdout=subprocess.PIPE)
    assert demo.stdout is not None
    assert demo.stdout.readline() == 'started\n'
    demo.kill()
    assert finish(demo)[0] == ''  # its end comes when the drive is gone too
