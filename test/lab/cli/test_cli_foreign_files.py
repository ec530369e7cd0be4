# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Files of strangers at the command line: a line, status 2, in seconds, a clean terminal."""

import io
import json
import os
import sqlite3
import sys
import zipfile
from collections.abc import Callable
from contextlib import closing
from pathlib import Path

import h5py
import numpy as np
import pandas as pd
import pytest
from mcap.writer import Writer
from mcap_records import foreign_numbers
from nptdms import ChannelObject, TdmsWriter
from processes import run_process

from stickslip_ros.lab.cli.main import main

LIMITED = 'ulimit -v 4000000; ulimit -t 30; exec "$0" -m stickslip_ros "$@"'
"""A process that may take 4 GB of addresses, most of them of numba, and 30 s of a processor."""
BAG = """
CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT, type TEXT, serialization_format TEXT);
CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER, data BLOB);
INSERT INTO topics VALUES(1, '/v', 'std_msgs/msg/Float64', 'cdr');
INSERT INTO messages(id, topic_id, timestamp, data) VALUES(1, 1, 1, x'000100000000000000000000');
"""
ENDLESS = """
CREATE VIEW message_definitions AS
WITH RECURSIVE c(x) AS (SELECT 1 UNION ALL SELECT x + 1 FROM c)
SELECT 'type' || x AS topic_type, 'x' AS encoded_message_definition, 'ros2msg' AS encoding FROM c;
"""
MANY_TOPICS = """
WITH RECURSIVE c(x) AS (SELECT 2 UNION ALL SELECT x + 1 FROM c LIMIT {})
INSERT INTO topics SELECT x, '/t' || x, 'std_msgs/msg/Float64', 'cdr' FROM c;
"""
USES = 9000


def database(sql: str) -> Callable[[Path], list[str]]:
    def write(folder: Path) -> list[str]:
        with closing(sqlite3.connect(folder / 'a.db3')) as connection:
            connection.executescript(sql)
        return ['info', str(folder / 'a.db3')]

    return write


def in_json(*messages: object) -> Callable[[Path], list[str]]:
    def write(folder: Path) -> list[str]:
        with (folder / 'a.mcap').open('wb') as file:
            writer = Writer(file)
            writer.start()
            channel = writer.register_channel('/t', 'json', 0)
            for at, message in enumerate(messages):
                writer.add_message(channel, at, json.dumps(message).encode(), at)
            writer.finish()
        output = str(folder / 'o.csv')
        named = ['--map', 'voltage_v=/t.x', '--map', 'position_m=/t.x']
        return ['export', str(folder / 'a.mcap'), *named, '-o', output]

    return write


def parameters(text: str) -> Callable[[Path], list[str]]:
    def write(folder: Path) -> list[str]:
        (folder / 'p.yaml').write_text(
            f'/**:\n  ros__parameters:\n    stand:\n      preload: {text}'
        )
        words = ['--amplitude', '60nm', '--steps', '2']
        return ['simulate', '--params', str(folder / 'p.yaml'), *words]

    return write


def workbook(folder: Path) -> list[str]:
    """Write a workbook of which a cell uses an entity 9,000 times."""
    path, plain = folder / 'a.xlsx', io.BytesIO()
    pd.DataFrame({'time_s': [0], 'position_m': [0.5]}).to_excel(plain, index=False)
    entity = f'<!DOCTYPE w [<!ENTITY e "{"x" * 100_000}">]>'
    cell = f'<row><c t="inlineStr"><is><t>{"&e;" * USES}</t></is></c></row></sheetData>'
    with zipfile.ZipFile(plain) as source, zipfile.ZipFile(path, 'w', 8) as target:
        for name in source.namelist():
            content = source.read(name)
            if name.endswith('sheet1.xml'):
                text = content.decode().replace('</sheetData>', cell)
                content = text.replace('<worksheet', f'{entity}<worksheet', 1).encode()
            target.writestr(name, content)
    return ['import', str(path), '-o', str(folder / 'o.csv')]


def cut_tdms(folder: Path) -> list[str]:
    with TdmsWriter(folder / 'a.tdms') as writer:
        writer.write_segment([ChannelObject('g', 'time_s', np.arange(40.0))])
    os.truncate(folder / 'a.tdms', (folder / 'a.tdms').stat().st_size - 9)
    return ['import', str(folder / 'a.tdms'), '-o', str(folder / 'o.csv')]


STAMPS = (
    [{'sec': [1, 2], 'nanosec': [3]}, {'sec': [1], 'nanosec': 3}],
    [{'sec': True, 'nanosec': False}],
    [{'sec': float('nan'), 'nanosec': 2}],
    [{'sec': 1, 'nanosec': 0}, {'sec': 1 << 80, 'nanosec': 0}],
)
TAGGED = (
    *('!!float ""', '!!timestamp x', '!!map [1]', '!!set {a}', '!!binary "@"', '{[1]: 2}'),
    *('!!value =', '2001-99-99', '&a [*a]', '!foo x', '!!python/tuple [1]', '0x' + 9000 * 'f'),
    *('1' * 9000, '[' * 3000, '{a: ' * 3000, '"\\ud800"'),
)
HOSTILE: dict[str, tuple[Callable[[Path], list[str]], str]] = {
    **{f'yaml {each[:20]}': (parameters(each), '') for each in TAGGED},
    **{
        f'stamp {each}': (in_json(*({'x': 1, 'header': {'stamp': e}} for e in each)), 'the stamp')
        for each in STAMPS
    },
    'header that is a list': (in_json({'x': 1, 'timestamp': {'sec': None}}), 'the stamp None s'),
    'a long name': (
        database(BAG + 'UPDATE topics SET name = hex(zeroblob(5000000));'),
        '1001 characters',
    ),
    'half a million values': (parameters('[' + '1.5, ' * 500_000 + '1.5]'), '20001 values'),
}
IN_A_PROCESS = {
    'an endless view': (database(BAG + ENDLESS), 'message_definitions is a view, or computed'),
    '300,000 topics': (database(BAG + MANY_TOPICS.format(300_000)), 'above the limit of 4096'),
    'an entity': (workbook, 'has a DOCTYPE'),
    'a library that logs': (cut_tdms, 'it was cut off'),
}  # fmt: skip


@pytest.mark.parametrize('name', HOSTILE)
def test_what_makes_no_sense_is_refused_in_a_line(name: str, tmp_path: Path, capsys):
    write, told = HOSTILE[name]
    assert main(write(tmp_path)) == 2
    said = capsys.readouterr().err
    assert told in said
    assert said.startswith('stickslip: ')
    assert said.count('\n') == 1


@pytest.mark.parametrize('name', IN_A_PROCESS)
def test_what_would_take_forever_or_all_memory_is_refused_at_once(name: str, tmp_path: Path):
    write, told = IN_A_PROCESS[name]
    done = run_process(['bash', '-c', LIMITED, sys.executable, *write(tmp_path)])
    assert (done.returncode, done.stderr.count('\n')) == (2, 1)
    assert told in done.stderr


ESCAPES = '\x1b]0;owned\x07', '\x9b31m', '\u202e', '\r'


def with_names(folder: Path, escape: str) -> list[list[str]]:
    """Write files of which each name carries an escape; return what reads them."""
    recording = folder / 'a.mcap'
    with recording.open('wb') as file:
        writer = Writer(file)
        writer.start()
        schema = writer.register_schema(f'a/{escape}', 'jsonschema', b'{}')
        channel = writer.register_channel(f'/v{escape}', 'json', schema)
        writer.add_message(channel, 1, json.dumps({f'{escape}v': 1}).encode(), 1)
        writer.add_metadata('stickslip_run', {f'k{escape}': f'v{escape}', 'time_origin_ns': '0'})
        writer.finish()
    (folder / 'a.csv').write_text(f'time_s,a{escape}b (n{escape}m)\n0,1\n1,2\n', newline='')
    (folder / 'a.yaml').write_text(
        f'/**:\n  ros__parameters:\n    {json.dumps("a" + escape)}: 1\n'
    )
    with h5py.File(folder / 'a.h5', 'w') as table:
        table['time_s'], table[f'a{escape}'] = [0.0, 1.0], [0.0, 1.0]
        table[f'a{escape}'].attrs['units'] = f'n{escape}m'
    output = ['-o', str(folder / 'o.csv')]
    strange = folder / f'n{escape}.mcap'
    strange.write_bytes(recording.read_bytes())
    return [
        ['info', str(recording)],
        ['info', str(recording), '--json'],
        ['info', str(strange)],
        ['info', str(folder / f'no{escape}.mcap')],
        ['recover', str(strange)],
        ['export', str(recording), '--map', f'voltage_v=/v{escape}.nope', *output],
        ['compare', str(recording), 'model'],
        *(['import', str(folder / name), *output] for name in ('a.csv', 'a.h5')),
        ['simulate', '--params', str(folder / 'a.yaml'), '--amplitude', '60nm'],
    ]


@pytest.mark.parametrize('escape', ESCAPES, ids=ascii)
def test_no_name_of_a_file_commands_the_terminal(escape: str, tmp_path: Path, capsys):
    for words in with_names(tmp_path, escape):
        main(words)
        out, err = capsys.readouterr()
        assert out + err
        assert escape not in out + err, words
        assert escape[:1] not in out + err, words


def test_a_terminal_without_a_letter_shows_its_escape(tmp_path):
    path = foreign_numbers(tmp_path / 'ä\u2126.mcap', [(1, 0, 1.5)])
    done = run_process(
        [sys.executable, '-m', 'stickslip_ros', 'info', path],
        env={**os.environ, 'PYTHONIOENCODING': 'ascii', 'PYTHONUTF8': '0'},
        encoding='ascii',
    )
    assert 'Traceback' not in done.stderr
    assert r'\u2126' in done.stdout + done.stderr


def test_a_node_judges_a_parameter_file_before_ros_does(tmp_path: Path):
    [_, _, path, *_] = parameters('[' + '1.5, ' * 500_000 + '1.5]')(tmp_path)
    limited = LIMITED.replace('-m stickslip_ros ', '')
    node = Path(sys.executable).with_name('drive')
    done = run_process(['bash', '-c', limited, node, '--ros-args', '--params-file', path])
    assert (done.returncode, done.stderr.count('\n')) == (2, 1)
    assert '20001 values in a parameter file' in done.stderr
