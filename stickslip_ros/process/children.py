# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Start processes that end with their parent, however the parent ends."""

import os
import shutil
from collections.abc import Sequence

_LAUNCH = '[ "$PPID" = "$0" ] && exec "$@"'
"""Run a command unless its parent ended before the system watched for that end."""


def bound_to_parent(words: Sequence[str], number: str = 'TERM') -> list[str]:
    """
    Return a command to which the system sends a signal when its parent is gone.

    The parent is the thread that starts the command. Without util-linux the command is returned
    unchanged.

    """
    if shutil.which('setpriv') is None:
        return [*words]
    return ['setpriv', '--pdeathsig', number, 'sh', '-c', _LAUNCH, str(os.getpid()), *words]
