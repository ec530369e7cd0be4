# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""One random damage to a file of the kernel cache, which must be told before anything is used."""

import random
import tempfile
from pathlib import Path

from stickslip_ros.kernels.cache import load_whole, save_whole

SIZE_MAX_BYTES = 4096


def damaged(data: bytes, chance: random.Random) -> bytes:
    """Return what a disk may give back of a file: flipped bits, an end cut off, zeros, more."""
    start = chance.randrange(len(data))
    many = chance.choice((1, 1, 2, 64, 4096))
    match chance.choice(('flip', 'cut', 'zeros', 'more')):
        case 'cut':
            return data[:start]
        case 'zeros':
            return data[:start] + bytes(len(data) - start)
        case 'more':
            return data + chance.randbytes(many)
    flipped = bytes(each ^ 1 << chance.randrange(8) for each in data[start : start + many])
    return data[:start] + flipped + data[start + many :]


def try_cache(case: int) -> bool:
    """Return whether a damaged file is refused, and a whole one found."""
    chance = random.Random(case)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / 'kernel.nbc'
        save_whole(path, data := chance.randbytes(chance.randrange(SIZE_MAX_BYTES)))
        found = load_whole(path) == data
        whole = path.read_bytes()
        path.write_bytes(broken := damaged(whole, chance))
        try:
            load_whole(path)
        except OSError:
            return found
        return found and broken == whole
