# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Take from Linux what Windows does not have.

The standard library and numpy of Linux need some of it; these modules keep what they imported.

"""

import asyncio  # noqa: F401
import builtins
import concurrent.futures.thread  # noqa: F401
import ctypes.util  # noqa: F401
import getpass  # noqa: F401
import mmap
import multiprocessing.util  # noqa: F401
import os
import pathlib
import platform
import random  # noqa: F401
import shutil
import signal
import socket
import subprocess  # noqa: F401
import sys
import tarfile  # noqa: F401
import tempfile  # noqa: F401
import threading  # noqa: F401
import time
import uuid  # noqa: F401

NAMES = {
    signal: 'SIGHUP SIGKILL SIGUSR1 SIGUSR2 SIGPIPE SIGALRM SIGQUIT SIGCHLD SIGTSTP SIGSTOP '
    'SIGCONT SIGPWR SIGWINCH alarm setitimer getitimer pause pthread_kill pthread_sigmask sigwait '
    'sigpending siginterrupt sigtimedwait sigwaitinfo pidfd_send_signal',
    os: 'O_PATH O_DIRECTORY O_NOFOLLOW O_NONBLOCK O_CLOEXEC O_NOCTTY O_SYNC O_DSYNC O_DIRECT '
    'O_TMPFILE getuid geteuid getgid getegid getgroups getpgid getpgrp getsid setsid setuid '
    'setgid fork forkpty killpg nice getloadavg statvfs fstatvfs chown fchown lchown fchmod '
    'mkfifo mknod pread pwrite preadv pwritev readv writev sendfile lockf sync fdatasync '
    'sched_getaffinity sched_setaffinity sched_setscheduler sched_getscheduler sched_yield '
    'posix_fadvise posix_fallocate pidfd_open memfd_create ttyname '
    'openpty wait3 wait4 waitid WNOHANG sysconf confstr pathconf initgroups setpriority '
    'getpriority getrandom copy_file_range splice eventfd setresuid',
    mmap: 'MAP_PRIVATE MAP_SHARED MAP_ANON MAP_ANONYMOUS PROT_READ PROT_WRITE PROT_EXEC',
    socket: 'AF_UNIX',
    time: 'clock_gettime clock_gettime_ns clock_getres pthread_getcpuclockid tzset',
}
ABSENT = 'fcntl resource pwd grp termios tty pty posix_ipc syslog spwd crypt nis ossaudiodev'


platform.uname()
shutil._use_fd_functions = False
for module, names in NAMES.items():
    for name in names.split():
        if hasattr(module, name):
            delattr(module, name)
for name in ABSENT.split():
    sys.modules[name] = None


def without_folders(function):
    """Return an `os.open` that opens no folder."""

    def opened(path, *given, **named):
        if pathlib.Path(path).is_dir():
            raise PermissionError(13, 'Permission denied', str(path))
        return function(path, *given, **named)

    return opened


def without_proc(function):
    """Return a function that finds no /proc."""

    def opened(path, *given, **named):
        if isinstance(path, (str, os.PathLike)) and os.fspath(path).startswith('/proc'):
            raise FileNotFoundError(2, 'No such file or directory', str(path))
        return function(path, *given, **named)

    return opened


os.open, builtins.open = without_folders(os.open), without_proc(builtins.open)
