# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Take from Linux what macOS does not have."""

import builtins
import os
import signal

NAMES = {
    os: 'O_PATH O_DIRECT O_TMPFILE sched_getaffinity sched_setaffinity sched_setscheduler '
    'sched_getscheduler posix_fadvise posix_fallocate pidfd_open fdatasync memfd_create '
    'eventfd getrandom copy_file_range splice setresuid',
    signal: 'SIGPWR SIGSTKFLT SIGRTMIN SIGRTMAX sigtimedwait sigwaitinfo pidfd_send_signal',
}
for module, names in NAMES.items():
    for name in names.split():
        if hasattr(module, name):
            delattr(module, name)


def without_proc(function):
    """Return a function that finds no /proc."""

    def opened(path, *given, **named):
        if isinstance(path, (str, os.PathLike)) and os.fspath(path).startswith('/proc'):
            raise FileNotFoundError(2, 'No such file or directory', str(path))
        return function(path, *given, **named)

    return opened


os.open, builtins.open = without_proc(os.open), without_proc(builtins.open)
