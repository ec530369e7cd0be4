# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Processes that end with the process that has started them, however that ends."""

import os
import shutil
from collections.abc import Sequence

_LAUNCH = '[ "$PPID" = "$0" ] && exec "$@"'
"""Goes on unless the parent was gone before its end would be heard of."""


def bound_to_parent(words: Sequence[str], number: str = 'TERM') -> list[str]:
    """
    Return a command to which the system sends a signal when its parent is gone.

    The parent is the thread that starts it. Where util-linux is not installed, the command is
    returned as it is.

    """
    if shutil.which('setpriv') is None:
        return [*words]
    return ['setpriv', '--pdeathsig', number, 'sh', '-c', _LAUNCH, str(os.getpid()), *words]
