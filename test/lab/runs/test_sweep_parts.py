# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""A sweep in a folder of tables: in parts, killed, resumed, on a cluster, and read again."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import dask.dataframe
import pandas as pd
import pytest
from distributed import LocalCluster
from processes import progress_of, start_process
from waiting import wait_until

from stickslip_ros import Parameters, compare
from stickslip_ros.lab.cli.main import main
from stickslip_ros.lab.measurements.sweep_table import read_table

pytestmark = pytest.mark.filterwarnings('ignore:Creating scratch directories:UserWarning')
STICKSLIP = Path(sys.executable).with_name('stickslip')
AXES = ['--preload', '0.1:1:10', '--amplitude', '60nm:150nm:10']
RUNS = 100
LONG = [*AXES, '--steps', '1000']
SHORT = [*AXES, '--steps', '20']


def sweep(folder: Path, *words: str) -> int:
    return main(['sweep', '-o', str(folder), *words])


def names(folder: Path) -> list[str]:
    return sorted(file.name for file in folder.iterdir())


@pytest.fixture(scope='module')
def one_table(tmp_path_factory: pytest.TempPathFactory) -> pd.DataFrame:
    """Give the short sweep as one table, of one thread."""
    path = tmp_path_factory.mktemp('one') / 'table.parquet'
    assert sweep(path, *SHORT, '--workers', '1') == 0
    return pd.read_parquet(path)


def test_parts_made_one_by_one_and_the_rest_are_the_table_of_one_thread_for_every_reader(
    one_table, tmp_path, capsys
):
    folder = tmp_path / 'folder'
    assert sweep(folder, *SHORT, '--part', '2/3') == 0
    assert names(folder) == ['part-2-of-3.parquet']
    pd.testing.assert_frame_equal(
        pd.read_parquet(folder), one_table[33:66].reset_index(drop=True), check_exact=True
    )
    assert main(['compare', str(folder), 'model']) == 2
    assert 'has 1 of 3 parts of a sweep; run the same sweep again' in capsys.readouterr().err
    (folder / '.part-1-of-3.parquet.0badcafe.part').write_text('of a worker that was killed')
    assert sweep(folder, *SHORT) == 0
    assert 'taken from the folder        1' in capsys.readouterr().out
    assert names(folder) == [f'part-{number}-of-3.parquet' for number in (1, 2, 3)]
    for table in (pd.read_parquet(folder), dask.dataframe.read_parquet(folder).compute()):
        found = table.reset_index(drop=True)
        pd.testing.assert_frame_equal(found, one_table, check_exact=True, check_dtype=False)
    rows, described = read_table(folder)
    assert [row['force_mean_n'] for row in rows] == one_table['force_mean_n'].tolist()
    assert described is not None
    assert f'Over {RUNS} points' in str(compare(folder, Parameters()))


@pytest.mark.parametrize(
    ('words', 'message'),
    [
        (['--part', '4/3'], 'number of --part 4 is not from 1 to 3; parts are counted from 1'),
        (['--part', '3'], "--part '3' is not NUMBER/COUNT; write 3/20"),
        (
            ['--part', '1/101'],
            'parts 101 is not from 1 to 100, for 100 runs; give --part NUMBER/100',
        ),
        (['--part', '1/4'], 'has parts of 3, not of 4; give --part NUMBER/3'),
        (['--set', 'runner.damping=1'], 'is a part of another sweep; choose another folder'),
    ],
)
def test_parts_that_do_not_fit_a_folder_are_refused(words, message, tmp_path, capsys):
    assert sweep(tmp_path / 'folder', *SHORT, '--part', '1/3') == 0
    assert sweep(tmp_path / 'folder', *SHORT, *words) == 2
    assert message in capsys.readouterr().err
    assert names(tmp_path / 'folder') == ['part-1-of-3.parquet']


def test_a_million_runs_need_a_folder_and_a_part_holds_at_most_a_table(tmp_path, capsys):
    million = ['--preload', '0.1:1:1000', '--amplitude', '60nm:150nm:1000', '--steps', '1']
    assert sweep(tmp_path / 'a.csv', *million) == 2
    told = (
        'number of runs 1000000 is above the maximum 100000 of one table; stickslip sweep -o NAME'
    )
    assert told in capsys.readouterr().err
    assert sweep(tmp_path / 'a.csv', *SHORT, '--part', '1/2') == 2
    assert 'is not a folder of tables; write -o NAME without an ending' in capsys.readouterr().err
    assert sweep(tmp_path / 'a', *million, '--part', '1/9') == 2
    assert (
        'number of parts 9 is not from 10 to 10000, for 1000000 runs; give --part NUMBER/10'
        in (capsys.readouterr().err)
    )
    assert sweep(tmp_path / 'a', *million, '--part', '7/10000') == 0
    frame = pd.read_parquet(tmp_path / 'a')
    assert len(frame) == 100
    assert frame['amplitude_m'].iloc[0] == pytest.approx(60e-9 + 600 * 90e-9 / 999, rel=1e-12)


def test_fresh_makes_the_parts_of_another_sweep_anew(tmp_path, one_table):
    folder = tmp_path / 'folder'
    assert sweep(folder, *AXES, '--steps', '10', '--part', '1/2') == 0
    (folder / '.part-1-of-2.parquet.0badcafe.part').write_text('of a worker that was killed')
    assert sweep(folder, *SHORT, '--part', '1/2', '--fresh') == 0
    assert names(folder) == ['part-1-of-2.parquet']
    assert sweep(folder, *SHORT, '--fresh') == 0
    assert names(folder) == ['part-1-of-1.parquet']
    pd.testing.assert_frame_equal(pd.read_parquet(folder), one_table, check_exact=True)


def test_a_killed_folder_goes_on_from_its_parts_and_its_journal(tmp_path, capsys):
    broken, whole = tmp_path / 'broken', tmp_path / 'whole'
    words = [str(STICKSLIP), 'sweep', *LONG, '--workers', '1', '--part', '2/2', '-o', str(broken)]
    journal = broken / '.part-2-of-2.parquet.journal'
    with start_process(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:

        def is_half_way() -> bool:
            assert process.poll() is None, process.communicate()
            return journal.exists() and journal.read_bytes().count(b'\n') >= 5

        wait_until(is_half_way, 'five lines of the journal', progress=progress_of(process))
        process.kill()
        process.communicate()
    assert names(broken) == [journal.name]
    for folder in (broken, whole):
        assert sweep(folder, *LONG, '--part', '2/2') == 0
        assert names(folder) == ['part-2-of-2.parquet']
    pd.testing.assert_frame_equal(
        pd.read_parquet(broken), pd.read_parquet(whole), check_exact=True
    )


def test_workers_of_a_cluster_write_their_parts_although_one_of_them_and_the_client_are_killed(
    tmp_path,
):
    folder, table = tmp_path / 'folder', tmp_path / 'table.parquet'
    assert sweep(folder, *LONG, '--part', '1/10') == 0
    with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=':0') as local:
        on_cluster = [*LONG, '--scheduler', local.scheduler_address]
        words = [str(STICKSLIP), 'sweep', *on_cluster, '-o', str(folder)]
        with start_process(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:

            def has_begun() -> bool:
                has_three = len([*folder.glob('part-*')]) >= 3
                assert has_three or process.poll() is None, process.communicate()
                return has_three

            wait_until(has_begun, 'three parts', progress=lambda: names(folder))
            os.kill(local.workers[0].pid, signal.SIGKILL)
            process.kill()
            process.communicate()
        assert sweep(folder, *on_cluster) == 0
    assert sweep(table, *LONG, '--workers', '1') == 0
    assert names(folder) == [f'part-{number:02}-of-10.parquet' for number in range(1, 11)]
    pd.testing.assert_frame_equal(
        pd.read_parquet(folder), pd.read_parquet(table), check_exact=True
    )
