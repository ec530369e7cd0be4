"""A process that wants to be prompt is: Linux, interpreter and garbage collector say so."""

import json
import os
import subprocess
import sys
from typing import Any

import pytest

from stickslip_ros.ros.pacing import KNOWS_SLICES, ON_LINUX, SLACK_S, SLICE_S, SWITCH_S

TELL = """
import json, os, sys, threading
from stickslip_ros.ros.pacing import wake_in_time, slack_s, slice_s
{before}
wake_in_time()
told = []
def tell():
    told.append([sys.getswitchinterval(), slack_s(), slice_s(), os.sched_getscheduler(0)])
tell()
thread = threading.Thread(target=tell)
thread.start()
thread.join()
print(json.dumps(told))
"""

CONFIGURE = """
import gc, json, rclpy
from rclpy.parameter import Parameter
from stickslip_ros.ros.node import StickSlipDrive
from stickslip_ros.ros.pacing import GarbageFreezer
rclpy.init()
node = StickSlipDrive(parameter_overrides=[Parameter('autostart', value=False)])
node.add_managed_entity(GarbageFreezer())
told = []
for _ in range(3):
    node.trigger_configure()
    told.append([gc.get_freeze_count(), len(gc.get_objects())])
    node.trigger_cleanup()
node.destroy_node()
rclpy.try_shutdown()
print(json.dumps(told))
"""


def told_by(program: str) -> Any:
    """Run a program in a process of its own: what it asks for holds for the whole process."""
    done = subprocess.run(
        [sys.executable, '-c', program], capture_output=True, text=True, check=True, timeout=60.0
    )
    return json.loads(done.stdout.splitlines()[-1])


@pytest.mark.skipif(not ON_LINUX, reason='only Linux can be asked')
def test_every_thread_wakes_up_in_time_and_takes_turns():
    here, new = told_by(TELL.format(before=''))
    assert here == new
    interval_s, slack_s, own_slice_s, policy = here
    assert interval_s == pytest.approx(SWITCH_S)
    assert slack_s == pytest.approx(SLACK_S)
    assert policy == os.SCHED_OTHER
    if KNOWS_SLICES:
        assert own_slice_s == pytest.approx(SLICE_S)


@pytest.mark.skipif(not ON_LINUX, reason='only Linux can be asked')
def test_a_policy_that_was_chosen_stays():
    choose = 'os.sched_setscheduler(0, os.SCHED_BATCH, os.sched_param(0))'
    for _, slack_s, own_slice_s, policy in told_by(TELL.format(before=choose)):
        assert slack_s == pytest.approx(SLACK_S)
        assert own_slice_s != pytest.approx(SLICE_S)
        assert policy == os.SCHED_BATCH


def test_what_a_configured_drive_consists_of_is_kept_from_collections():
    told = told_by(CONFIGURE)
    for kept, collected in told:
        assert kept > 50_000
        assert collected < 0.02 * kept
    # The second configuration still makes things that last; none leaves anything behind for ever.
    assert told[-1][0] < 1.002 * told[1][0]
