# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""What a foreign file may cost, as SECURITY.md tells; each reader asks before it spends."""

import json
from typing import Any, Final, NamedTuple

from stickslip_ros.errors import RecordingError

PER_BYTE: Final = 4  # of a packed file, beyond what is free: so a small one costs little


class Limit(NamedTuple):
    """The most that a file, or a message, may ask for."""

    what: str
    most: int
    hint: str = 'take a part of it'
    free: int | None = None  # of packed content: whatever the size of the file

    def allowed(self, stored_bytes: int | None) -> int:
        """Return the limit of content that is stored in so many bytes; None: it is not packed."""
        if self.free is None or stored_bytes is None:
            return self.most
        return min(self.most, self.free + PER_BYTE * stored_bytes)

    def check(self, count: int, path: Any = 'a message', stored_bytes: int | None = None) -> None:
        """Refuse a count above the limit."""
        if count > (most := self.allowed(stored_bytes)):
            problem = f'it asks for {count} {self.what}, above the limit of {most}'
            raise RecordingError(path, problem, self.hint)


_AS_CSV: Final = 'leave some out, or save it as CSV'
CHUNK_BYTES = Limit('bytes of a chunk, a message, or of all open chunks', 1 << 30)
RECORDS = Limit('records in a chunk', 1 << 26, 'unpack it with "mcap decompress"', 1000)
INDEX_BYTES = Limit('bytes of a summary', 1 << 26, 'split the recording')
NAMES_MOST = Limit('topics, types, entries, columns or sheets', 4096, 'leave some out')
LOSSES = Limit('damaged places to recover around', 4096, 'take another copy of the file')
NAME_CHARACTERS = Limit('characters of a topic or type', 1000, 'rename it')
DEFINITION_MOST = Limit('characters of a definition of a message', 4_000_000, 'take another topic')
LABEL_MOST = Limit('characters of a label, a frame or a joint', 10_000, 'send shorter ones')
AXES = Limit('axes or joints of a message', 4096, 'send fewer')
YAML_CHARACTERS = Limit('characters of YAML', 4_000_000)
YAML_VALUES = Limit('values in YAML', 200_000)
PARAMETER_VALUES = Limit('values in a parameter file', 20_000)
YAML_DEPTH = Limit('levels of YAML', 64, 'nest less')
NUMBER_CHARACTERS = Limit('characters of a number', 400, 'round it')
JSON_BYTES = Limit('bytes of JSON', 1 << 26)
JSON_PARTS = Limit('lists and objects in JSON', 2_000_000)
NUMBERS_MOST = Limit('numbers of a table', 20_000_000, _AS_CSV, 2_000_000)
CELLS_MOST = Limit('cells of a text', 1 << 40, 'take empty columns away', 2_000_000)
TABLE_BYTES = Limit('unpacked bytes of a table or another file', 400_000_000, _AS_CSV)
TAGS = Limit('tags in a workbook', 25_000_000, _AS_CSV, 2_000_000)


def load_json(text: str | bytes, path: object = 'a message', **options: Any) -> Any:
    """Return the value of JSON; ValueError if it is none, RecordingError if it is too large."""
    data = text.encode(errors='surrogatepass') if isinstance(text, str) else text
    JSON_BYTES.check(len(data), path)
    JSON_PARTS.check(data.count(b'[') + data.count(b'{'), path)
    try:
        return json.loads(data, **options)
    except RecursionError:
        raise ValueError('it is nested too deep') from None
