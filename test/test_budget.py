# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The limits of foreign files: one row each, as SECURITY.md says them."""

import json
import re
from pathlib import Path

import pytest

from stickslip_ros import budget
from stickslip_ros.budget import Limit
from stickslip_ros.errors import RecordingError

PAGE = Path(__file__).parents[1] / 'SECURITY.md'
STORED_BYTES = 1000
FILE_LIMITS = [each for each in vars(budget).values() if isinstance(each, Limit)]


def row_of(limit: Limit) -> str:
    free = '' if limit.free is None else f'{limit.free:,} and {budget.PER_BYTE} for each byte'
    return f'| {limit.what} | {limit.most:,} | {free} |'


def test_the_page_tells_each_limit():
    rows = re.findall(r'^\| .* \| [\d,]+ \| .*\|$', PAGE.read_text(encoding='utf-8'), re.MULTILINE)
    assert [re.sub(r' +', ' ', each) for each in rows] == [
        re.sub(r' +', ' ', row_of(each)) for each in FILE_LIMITS
    ]


@pytest.mark.parametrize('limit', FILE_LIMITS, ids=lambda each: each.what)
def test_what_reaches_a_limit_is_taken_and_more_is_refused_with_value_and_remedy(limit: Limit):
    limit.check(limit.most)
    told = f'{limit.most + 1} {limit.what}, above the limit of {limit.most}; {limit.hint}'
    with pytest.raises(RecordingError, match=re.escape(told)):
        limit.check(limit.most + 1)


@pytest.mark.parametrize('limit', [each for each in FILE_LIMITS if each.free is not None])
def test_a_small_file_packs_little(limit: Limit):
    most = limit.free + budget.PER_BYTE * STORED_BYTES
    limit.check(most, stored_bytes=STORED_BYTES)
    with pytest.raises(RecordingError, match=f'above the limit of {most};'):
        limit.check(most + 1, stored_bytes=STORED_BYTES)


def test_json_is_loaded_within_its_limits():
    assert budget.load_json('{"a": [1, 2.5, "x"]}') == {'a': [1, 2.5, 'x']}
    many = budget.JSON_PARTS.most + 1
    with pytest.raises(RecordingError, match=f'{many} lists and objects'):
        budget.load_json('[],' * many)
    with pytest.raises(RecordingError, match='bytes of JSON'):
        budget.load_json(b' ' * (budget.JSON_BYTES.most + 1))
    for wrong in ('[' * 100_000, '{"a"', json.dumps([1])[:-1]):
        with pytest.raises(ValueError, match=r'.'):
            budget.load_json(wrong)
