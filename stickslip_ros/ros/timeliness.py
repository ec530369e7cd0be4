"""What a process can do, without privileges, to wake up in time: slices, switches, garbage."""

import ctypes
import gc
import os
import platform
import re
import sys
from typing import Final

from rclpy.lifecycle import LifecycleState, ManagedEntity, TransitionCallbackReturn

from stickslip_ros.units import NS_PER_S

SWITCH_S: Final = 5e-5
"""Longest time that a callback may hold the interpreter while the drive's tick is due."""
SLICE_S: Final = 3e-4
"""Slice that is asked of Linux: longer than a tick computes, shorter than what others have."""
SLACK_S: Final = 1e-9
"""By how much Linux may let a sleep last longer."""

THIS_THREAD: Final = 0
_CALLS: Final = {
    'x86_64': {'set': 314, 'get': 315},
    'aarch64': {'set': 274, 'get': 275},
    'riscv64': {'set': 274, 'get': 275},
}
"""Numbers of sched_setattr and sched_getattr, for which C libraries have no name before 2025."""
ON_LINUX: Final = sys.platform == 'linux'
KNOWS_SLICES: Final = (
    ON_LINUX
    and platform.machine() in _CALLS
    and tuple(map(int, re.findall(r'\d+', platform.release())[:2])) >= (6, 12)
)
"""Whether a thread may ask for slices of its own; older kernels take no notice."""
_SET_TIMER_SLACK: Final = 29
_GET_TIMER_SLACK: Final = 30


class _Attributes(ctypes.Structure):
    """``struct sched_attr`` of Linux."""

    _fields_ = (
        ('size', ctypes.c_uint32),
        ('policy', ctypes.c_uint32),
        ('flags', ctypes.c_uint64),
        ('nice', ctypes.c_int32),
        ('priority', ctypes.c_uint32),
        ('runtime_ns', ctypes.c_uint64),
        ('deadline_ns', ctypes.c_uint64),
        ('period_ns', ctypes.c_uint64),
    )


def be_prompt() -> None:
    """
    Have the threads of this process, and of those that it starts, wake up when they are due.

    To be called before threads start: they inherit it. Where the system is not Linux, or knows
    only a part of it, the rest is done.

    - The interpreter changes threads after `SWITCH_S`.
    - Linux lets a sleep last 50 us longer than asked for, to wake up seldom; now it does not.
    - From Linux 6.12 on, a thread with a short slice that wakes up takes the processor from one
      with a long slice, instead of waiting for the end of that (2.8 ms on two cores). Its share of
      the processor stays the same.

    """
    sys.setswitchinterval(SWITCH_S)
    if ON_LINUX:
        ctypes.CDLL(None).prctl(_SET_TIMER_SLACK, ctypes.c_ulong(round(SLACK_S * NS_PER_S)))
    if KNOWS_SLICES:
        _ask_for_slices()


def slice_s(thread: int = THIS_THREAD) -> float | None:
    """Return the slice of a thread, given its number, s; None where Linux does not tell."""
    attributes = _attributes(thread) if KNOWS_SLICES else None
    return attributes.runtime_ns / NS_PER_S if attributes and attributes.runtime_ns else None


def slack_s() -> float | None:
    """Return how much longer a sleep of the calling thread may last, s; None if not on Linux."""
    if not ON_LINUX:
        return None
    return int(ctypes.CDLL(None).prctl(_GET_TIMER_SLACK)) / NS_PER_S


def _ask_for_slices() -> None:
    """Ask for short slices; a thread whose policy was chosen by ``chrt`` is left alone."""
    attributes = _attributes(THIS_THREAD)
    if attributes is not None and attributes.policy == os.SCHED_OTHER:
        attributes.runtime_ns = round(SLICE_S * NS_PER_S)
        _call('set', THIS_THREAD, ctypes.byref(attributes), 0)


def _attributes(thread: int) -> _Attributes | None:
    attributes = _Attributes()
    size = ctypes.sizeof(attributes)
    failed = _call('get', thread, ctypes.byref(attributes), size, 0)
    return None if failed else attributes


def _call(name: str, *arguments: object) -> int:
    """Make a call of Linux; anything but 0 is a failure."""
    return int(ctypes.CDLL(None).syscall(_CALLS[platform.machine()][name], *arguments))


def keep_what_there_is() -> None:
    """
    Exempt all objects of this process from garbage collection.

    A full collection looks at every object, of which the compiled kernels have more than 100 000:
    without this the drive stands still for 40 to 90 ms, some ten seconds after its start.

    """
    gc.freeze()


class Keeper(ManagedEntity):  # type: ignore[misc]
    """Keeps what there is whenever a lifecycle node has been configured, before it ticks."""

    def on_configure(self, _: LifecycleState) -> TransitionCallbackReturn:
        """Collect what the last configuration has left behind, and keep the rest."""
        gc.unfreeze()
        gc.collect()
        keep_what_there_is()
        return TransitionCallbackReturn.SUCCESS
