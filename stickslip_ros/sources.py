# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Which sources decide the numbers of a run: other ones may round differently."""

import hashlib
from functools import cache
from pathlib import Path
from typing import Final

FOLDERS: Final = ('kernels', 'contact', 'drive', 'instrument')
PACKAGE: Final = Path(__file__).resolve().parent


@cache
def sources_digest(package: Path = PACKAGE) -> str:
    """Return a digest of these sources, 16 hexadecimal digits."""
    digest = hashlib.sha256()
    for folder in FOLDERS:
        for source in sorted((package / folder).rglob('*.py')):
            digest.update(source.read_bytes())
    return digest.hexdigest()[:16]
