# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""A sweep of any size, as a folder of tables: each part is one Parquet file, made by itself."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from stickslip_ros.errors import OutOfRange, RecordingError, WrongKind
from stickslip_ros.extras import load_extra
from stickslip_ros.files import SWEEP_PARTS, make_folder
from stickslip_ros.lab.measurements.sweep_table import (
    SWEEP_DIGEST,
    check_table_path,
    parts_of,
    read_arrow,
    write_table,
)
from stickslip_ros.lab.runs.batch import Progress, run_batch
from stickslip_ros.lab.runs.journal import Journal
from stickslip_ros.lab.runs.sweep import CASES_MAX, PARTS_MAX, Sweep, SweepCase, run_sweep
from stickslip_ros.process.stopping import Stopped

PART_CASES = 2_500  # cases of a part, if the number of parts is not given
_REMAKE = 'delete it, and the same command makes it again'


@dataclass(frozen=True)
class SweepParts:
    """The files of a sweep in a folder that all its workers share."""

    sweep: Sweep
    folder: Path
    count: int

    def path(self, number: int) -> Path:
        """Return the file of a part, counted from 1."""
        return self.folder / f'part-{number:0{len(str(self.count))}}-of-{self.count}.parquet'

    def journal(self, number: int) -> Path:
        path = self.path(number)
        return path.with_name(f'.{path.name}.journal')

    def cases_of(self, number: int) -> range:
        """Return the numbers of the cases of a part."""
        first, end = (self.sweep.total * part // self.count for part in (number - 1, number))
        return range(first, end)

    def cases(self, number: int) -> list[SweepCase]:
        numbers = self.cases_of(number)
        return self.sweep.cases(numbers.start, numbers.stop)

    def write(self, number: int) -> None:
        """Run a part in the process of the caller, such as a worker of Dask; write its file."""
        if not self.path(number).exists():
            rows = run_sweep(self.sweep, cases=self.cases(number), workers=1)
            write_table(rows, self.path(number), self.sweep.parameters, self.sweep.digest())

    def write_here(self, number: int, workers: int, progress: Progress) -> None:
        """Run a part in threads; an interrupted one continues from its journal."""
        path, cases = self.path(number), self.cases(number)
        digest = self.sweep.digest()
        with Journal(self.journal(number), f'{digest} {path.stem}', len(cases)) as journal:
            run = partial(run_sweep, self.sweep, cases=cases, journal=journal)
            rows = run(workers=workers, progress=progress)
            write_table(rows, path, self.sweep.parameters, digest)
            journal.remove()


def parse_part(text: str) -> tuple[int, int]:
    """Return number and count of ``3/20``; refuse another form."""
    number, slash, count = text.partition('/')
    if not (slash and number.isdecimal() and count.isdecimal()):
        raise WrongKind('--part', text, 'NUMBER/COUNT', 'write 3/20 for the third of 20 parts')
    if not 1 <= int(number) <= int(count):
        limit = f'not from 1 to {count}'
        raise OutOfRange('number of --part', int(number), '', limit, 'parts are counted from 1')
    return int(number), int(count)


def parts_for(
    sweep: Sweep, folder: Path, part: str | None, *, fresh: bool
) -> tuple[SweepParts, Sequence[int]]:
    """
    Return the parts of a sweep, and the numbers of those to make: one, as ``3/20``, or all.

    Their number is by default that of the folder, or so that a part has PART_CASES cases.

    Raises a StickSlipError if the folder holds another sweep or other parts of it, or if the parts
    would be too many or too large.

    """
    number, count = parse_part(part) if part else (0, 0)
    make_folder(folder)
    check_table_path(folder / 'part.parquet')
    if fresh:
        which = SweepParts(sweep, folder, count).path(number).name if count else SWEEP_PARTS
        for file in (*folder.glob(which), *folder.glob(f'.{which}.*')):
            file.unlink()
    files, digest = sorted(folder.glob(SWEEP_PARTS)), sweep.digest()
    for file in files:
        if _digest_of(file) != digest:
            hint = 'choose another folder, or start again with --fresh'
            raise RecordingError(file, 'is a part of another sweep', hint)
    counts = {parts_of(file) for file in files}
    found = count or next(iter(counts), min(-(-sweep.total // PART_CASES), PARTS_MAX))
    most = min(sweep.total, PARTS_MAX)
    if not (least := -(-sweep.total // CASES_MAX)) <= found <= most:
        limit = f'not from {least} to {most}, for {sweep.total} runs'
        hint = f'give --part NUMBER/{least if found < least else most}'
        raise OutOfRange('number of parts', found, '', limit, hint)
    if counts - {found}:
        hint = f'give --part NUMBER/{min(counts)}, or choose another folder'
        raise RecordingError(folder, f'has parts of {min(counts)}, not of {found}', hint)
    return SweepParts(sweep, folder.resolve(), found), [number] if number else range(1, found + 1)


def run_parts(
    parts: SweepParts, numbers: Sequence[int], workers: int, scheduler: str, progress: Progress
) -> int:
    """
    Make the parts that are not yet in the folder; return how many were there.

    In threads, or on a Dask cluster whose workers write to the folder themselves; progress is told
    in runs, or in parts of a cluster.

    """
    todo = [number for number in numbers if not parts.path(number).exists()]
    try:
        if scheduler:
            run_batch(parts.write, todo, scheduler=scheduler, progress=progress)
        else:
            _run_here(parts, numbers, todo, workers, progress)
    except Stopped:
        left = sum(not parts.path(number).exists() for number in numbers)
        text = f'stopped with {len(numbers) - left} of {len(numbers)} parts in {parts.folder}'
        raise Stopped(f'{text}; the same command goes on') from None
    if missing := [number for number in numbers if not parts.path(number).exists()]:
        hint = 'name a folder that this machine shares with all workers'
        raise RecordingError(parts.folder, f'lacks {len(missing)} parts that were written', hint)
    if all(parts.path(number).exists() for number in range(1, parts.count + 1)):
        for unfinished in parts.folder.glob(f'.{SWEEP_PARTS}.*'):  # of workers that were killed
            unfinished.unlink(missing_ok=True)
    return len(numbers) - len(todo)


def _run_here(
    parts: SweepParts, numbers: Sequence[int], todo: Sequence[int], workers: int, show: Progress
) -> None:
    """Make parts one after another, each with all threads."""
    sizes = {number: len(parts.cases_of(number)) for number in numbers}
    total, done = sum(sizes.values()), sum(sizes[number] for number in set(numbers) - {*todo})

    def show_all(runs: int, _: int) -> None:
        show(done + runs, total)

    for number in todo:
        parts.write_here(number, workers, show_all)
        done += sizes[number]


def _digest_of(file: Path) -> str:
    """Return of which sweep a file is a part; RecordingError if it is damaged."""
    parquet = load_extra('a Parquet file', 'pyarrow.parquet')
    try:
        found = parquet.read_metadata(file).metadata or {}
    except (OSError, ValueError):
        read_arrow(file, _REMAKE)
        raise
    return (found.get(SWEEP_DIGEST.encode()) or b'').decode()
