# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
``make same ARGS=COMMIT``: the same runs on a commit and on this tree, compared byte by byte.

Random programs of real-valued commands on every stand of ``make fuzz``, saw-teeth from the command
line, and a node in lockstep with a controller over DDS. Both trees run on this machine, in
the same environment: nothing is kept, since bytes may differ between machines.
"""

import argparse
import os
import shlex
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from itertools import product, zip_longest
from pathlib import Path
from typing import Any

from mcap.reader import make_reader

ROOT = Path(__file__).resolve().parent.parent
SEEDS = range(1, 5)
REALISTIC = ROOT / 'config' / 'realistic.yaml'
DOMAINS = range(41, 101)
WALL_CLOCK = {'wall_start', 'stickslip_ros', 'sources'}
"""Fields of the metadata that may differ."""
VERBS = {
    'default': 'simulate --preload 0.7 --amplitude 130e-9 --steps 60',
    'realistic': f'simulate --params {shlex.quote(str(REALISTIC))} --voltage 113.76725643485543 '
    '--frequency 1153.3955451232346 --steps 50',
    'backwards': 'simulate --voltage 87.3 --frequency -333.3 --steps 20 --set sim.block=5e-3',
}
"""Saw-teeth from the command line."""
BLOCK_S, STEPS_S, END_S, TARGET_M, GAIN_V_PER_M = 0.01, 0.1, 1.0, 3e-6, 5e7
"""Run of the node over DDS: a block of lockstep, time of the first steps, all; a control loop."""
TREES = 'before', 'after'


def main() -> int:
    """Record with this tree, or compare it with a commit; 1 if they differ."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('commit', nargs='?', default='HEAD', help='default: %(default)s')
    parser.add_argument('--record', type=Path, metavar='DIR', help='record these runs and end')
    parser.add_argument('--part', type=int, default=0, help='of --record: even or odd runs')
    parser.add_argument('--record-node', type=Path, metavar='DIR', help='the node, and end')
    parser.add_argument('--no-node', action='store_true', help='leave the node away')
    parser.add_argument(
        '--data',
        action='store_true',
        help='of a commit with other parameters: not what names them',
    )
    chosen = parser.parse_args()
    if chosen.record is not None:
        record_stands(chosen.record, chosen.part)
        return 0
    if chosen.record_node is not None:
        record_node(chosen.record_node)
        return 0
    with tempfile.TemporaryDirectory() as folder:
        return compare_with(
            chosen.commit, Path(folder), with_node=not chosen.no_node, data=chosen.data
        )


def record_stands(folder: Path, part: int) -> None:
    """Record half of the stands of the fuzz test, each under a random program of commands."""
    import numpy as np  # noqa: PLC0415 - the modules of the tree that is asked

    sys.path.insert(0, str(ROOT / 'test' / 'fuzz'))
    from fuzz_case import program_of, record  # noqa: PLC0415
    from fuzz_stands import STANDS, stand_of  # noqa: PLC0415

    for seed, stand in list(product(SEEDS, STANDS))[part::2]:
        rng = np.random.default_rng([seed, *stand.encode()])
        parameters = stand_of(stand, rng)
        record(parameters, program_of(rng, parameters), folder / f'{stand} {seed}.mcap')


def record_node(folder: Path) -> None:
    """Record a node that a client controls in lockstep, over DDS; this one serves every tree."""
    from stickslip_ros.parameters import load_yaml  # noqa: PLC0415 - of the tree that is asked
    from stickslip_ros.testing import LockstepClient, Stand  # noqa: PLC0415

    def answer(time_s: float, position_m: float) -> list[tuple[str, float]]:
        error_v = GAIN_V_PER_M * (TARGET_M - position_m)
        return [('voltage', min(max(150.0 + error_v, 0.0), 300.0))] if time_s > STEPS_S else []

    os.chdir(folder)  # what the node says of itself names its folder, from the present one on
    values: dict[str, Any] = {
        **load_yaml(REALISTIC).changed(),
        **dict.fromkeys(('sim.lockstep', 'sim.publish_truth', 'record.on_start'), True),
        'record.directory': 'node',
        'record.name': 'node.mcap',
        'sim.block': BLOCK_S,
    }
    stand = Stand(int(os.environ['ROS_DOMAIN_ID']), values)
    operator = stand.operator
    client = LockstepClient(operator.node, BLOCK_S, answer, first=[('steps', 30)])
    operator.spin_until(lambda: operator.time_ns >= END_S * 1e9, 'the end of the run', 120.0)
    client.close()
    operator.spin_until(lambda: operator.time_ns >= client.granted_ns, 'what is granted')
    stand.close()


def git(*words: str) -> str:
    """Return what git says about this tree."""
    done = subprocess.run(['git', *words], cwd=ROOT, check=True, capture_output=True, text=True)
    return done.stdout.strip()


@contextmanager
def tree_of(commit: str, folder: Path) -> Iterator[Path]:
    """Give the files of a commit, in a worktree that git forgets afterwards."""
    tree = folder / 'tree'
    git('worktree', 'add', '--detach', '--force', str(tree), commit)
    try:
        yield tree
    finally:
        git('worktree', 'remove', '--force', str(tree))


def compare_with(commit: str, folder: Path, *, with_node: bool, data: bool) -> int:
    """Record with both trees, one after the other; tell where they part."""
    commit = git('rev-parse', '--short=12', '--verify', f'{commit}^{{commit}}')
    with tree_of(commit, folder) as other:
        for tree, name in zip((other, ROOT), TREES, strict=True):
            print(f'recording with {tree}', flush=True)
            record_all(tree, folder / name, with_node=with_node)
    files = [path.relative_to(folder) for path in folder.rglob('*.mcap')]
    names = sorted({Path(*path.parts[1:]) for path in files})
    messages = 0
    differ = 0
    for run in names:
        count, difference = compare(folder / 'before' / run, folder / 'after' / run, data=data)
        messages += count
        if difference:
            differ += 1
            print(f'DIFFERENT {run}: {difference}')
    print(f'{len(names)} runs, {messages} messages; {differ} runs differ from {commit}')
    return 1 if differ or not names else 0


def record_all(tree: Path, folder: Path, *, with_node: bool) -> None:
    """Let a tree record every run."""
    (folder / 'node').mkdir(parents=True)
    domain = str(DOMAINS[0] + os.getpid() % len(DOMAINS))
    environment = os.environ | {'PYTHONPATH': str(tree), 'ROS_DOMAIN_ID': domain}
    code = 'import sys; from stickslip_ros.lab.cli.main import main; sys.exit(main(sys.argv[1:]))'
    stickslip = [sys.executable, '-c', code]

    def run(*command: str) -> None:
        subprocess.run(command, cwd=folder, env=environment, check=True, stdout=subprocess.DEVNULL)

    run(*stickslip, 'compile')
    verbs = [
        [*stickslip, *shlex.split(words), '-o', f'simulate {name}.mcap']
        for name, words in VERBS.items()
    ]
    script = [
        sys.executable,
        str(tree / 'scripts' / 'same_bytes.py'),
        '--record',
        str(folder),
        '--part',
    ]
    jobs = [[*script, '0'], [*script, '1'], *verbs]
    if with_node:
        jobs.append([sys.executable, __file__, '--record-node', str(folder)])
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        list(pool.map(lambda job: run(*job), jobs))


def compare(before: Path, after: Path, *, data: bool) -> tuple[int, str]:
    """Return the number of messages, and where two recordings part; empty if nowhere."""
    if not (before.exists() and after.exists()):
        return 0, f'is not in {"before" if after.exists() else "after"}'
    count = 0
    for ours, theirs in zip_longest(_messages(after), _messages(before)):
        is_named = data and ours and theirs and ours[0] == theirs[0] and ours[0].endswith('/info')
        if ours != theirs and not is_named:
            topic, time_ns = (ours or theirs)[:2]
            return count, f'message {count}, {topic} at {time_ns} ns'
        count += 1
    if not data and _surroundings(before) != _surroundings(after):
        return count, 'metadata, attachments, schemas or channels'
    return count, ''


def _messages(path: Path) -> Iterator[tuple[Any, ...]]:
    with path.open('rb') as stream:
        for _, channel, each in make_reader(stream).iter_messages(log_time_order=False):
            yield channel.topic, each.log_time, each.publish_time, each.sequence, each.data


def _surroundings(path: Path) -> list[Any]:
    """Return what a file says beside its messages, but for the wall clock."""
    with path.open('rb') as stream:
        reader = make_reader(stream)
        summary = reader.get_summary()
        assert summary is not None
        metadata = {
            each.name: {k: v for k, v in each.metadata.items() if k not in WALL_CLOCK}
            for each in reader.iter_metadata()
        }
        attachments = {each.name: each.data for each in reader.iter_attachments()}
        schemas = {key: (each.name, each.data) for key, each in summary.schemas.items()}
        channels = {
            key: (each.topic, each.schema_id, each.metadata)
            for key, each in summary.channels.items()
        }
    return [metadata, attachments, schemas, channels]


if __name__ == '__main__':
    sys.exit(main())
