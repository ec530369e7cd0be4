# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Digest of the sources that decide the numbers of a run."""

import hashlib
from functools import cache
from pathlib import Path
from typing import Final

FOLDERS: Final = ('kernels', 'contact', 'drive', 'instrument')
PACKAGE: Final = Path(__file__).resolve().parent


@cache
def sources_digest(package: Path = PACKAGE) -> str:
    """Return a digest of the sources in FOLDERS, 16 hexadecimal digits."""
    digest = hashlib.sha256()
    for folder in FOLDERS:
        for source in sorted((package / folder).rglob('*.py')):
            digest.update(source.read_bytes())
    return digest.hexdigest()[:16]
