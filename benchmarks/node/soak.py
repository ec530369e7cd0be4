"""Ten minutes at real time, recording: memory, overruns and completeness, beside a bare loop."""

import tempfile
import time
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from pathlib import Path

import numpy as np
from mcap.reader import make_reader

from benchmarks.node.lateness import Window, summary
from benchmarks.node.programs import BareLoop, Drive, Program, may_begin_with, opened
from benchmarks.node.recording import lost_in
from benchmarks.outcome import Outcome, Row, Verdict
from benchmarks.sizes import Sizes
from stickslip_ros.recording.reader import Recording

NODE, BARE = 'the node, recording', 'bare loop'
RECORDING = 'bare loop, recording likewise'
BESIDE = 'beside.mcap'
WARM_UP_SHARE = 0.2
MEGA = 1e6
KILO = 1e3
BLOCK_NS = 1_000_000
SIGMAS = 2.0


def run(sizes: Sizes) -> Outcome:
    """Run the node beside a bare loop."""
    return _run(sizes, NODE, (), lambda _: BareLoop(BARE))


def run_recording(sizes: Sizes) -> Outcome:
    """Run the node beside a bare loop that records the same, with the same recorder."""
    return _run(
        sizes,
        NODE,
        (),
        lambda folder: BareLoop(RECORDING, '--record-apart', f'{folder}/{BESIDE}'),
    )


def run_fifo(sizes: Sizes) -> Outcome:
    """Run the node, under a real-time policy if that is allowed, beside a bare loop."""
    before = sizes.real_time
    if may_begin_with(before):
        return _run(sizes, f'{NODE}, {" ".join(before)}', before, lambda _: BareLoop(BARE))
    return _run(sizes, f'{NODE}; no privilege for {before[0]}', (), lambda _: BareLoop(BARE))


def _run(
    sizes: Sizes, name: str, before: Sequence[str], rival: Callable[[str], Program]
) -> Outcome:
    with tempfile.TemporaryDirectory() as folder, ExitStack() as stack:
        settings = {'record.on_start': 'true', 'record.directory': folder}
        makers = [lambda: Drive(name, settings, before=before), lambda: rival(folder)]
        programs = opened(stack, makers)
        for program in programs:
            program.start()
        time.sleep(sizes.settle_s)
        for program in programs:
            program.reset()
        memory_bytes, windows = _watch(programs, sizes)
        heard = [program.listener.ask('report') for program in programs]
        for program in programs:
            program.stop()
        stack.close()
        [path] = set(Path(folder).glob('*.mcap')) - {Path(folder, BESIDE)}
        lost = lost_in(path) + holes_in(path)
        file_bytes, chunks = path.stat().st_size, chunks_in(path)
    rows: list[Row] = []
    for i, program in enumerate(programs):
        rows.append(
            {
                'program': program.name,
                **_memory_row(memory_bytes[i], sizes.sample_s),
                **_lateness_row(windows[i]),
                'positions': heard[i]['counts'].get('position', 0),
                'missing_at_subscriber': heard[i]['missing'],
            }
        )
    return Outcome(
        f'{sizes.soak_s:g} s at real time, 1 kHz, 50 kS/s, moving: both at the same time',
        rows,
        _verdicts(rows, excess_of(*windows), lost),
        [
            (
                f'resident memory every {sizes.sample_s:g} s; growth from the second fifth on, '
                'with its standard error, which allows for readings that depend on the ones before'
            ),
            (
                f'the recording, {file_bytes / MEGA:.3g} MB, lacks {lost} messages by its '
                'sequence numbers and by the stamps of position; it has '
                f'{chunks / (sizes.soak_s / 60.0):.3g} chunks per minute'
            ),
            (
                'overruns of the node beyond those of the bare loop: {:.3g} per minute, with a '
                'standard error of {:.2g} from minute to minute'.format(*excess_of(*windows))
            ),
        ],
    )


def growth_of(values: Sequence[float], period: float) -> tuple[float, float]:
    """
    Return the slope of values taken once a period, and its standard error.

    Neighbouring residuals that are alike count as fewer: their number is reduced by
    (1 - r) / (1 + r), r being the correlation of neighbours.

    """
    value = np.array(values, dtype=float)
    time_ = period * np.arange(len(value))
    if len(value) < 4:
        return 0.0, float('nan')
    slope, start = np.polyfit(time_, value, 1)
    rest = value - (start + slope * time_)
    power = float(rest @ rest)
    if power <= np.finfo(float).eps * float(value @ value):
        return float(slope), 0.0
    r = min(max(0.0, float(rest[1:] @ rest[:-1]) / power), 0.99)
    freedom = max(1.0, len(value) * (1.0 - r) / (1.0 + r) - 2.0)
    centred = time_ - time_.mean()
    return float(slope), float(np.sqrt(power / freedom / (centred @ centred)))


def excess_of(ours: Sequence[Window], theirs: Sequence[Window]) -> tuple[float, float]:
    """
    Return how many more overruns a minute one program had, and the standard error of that.

    What disturbs the machine in a minute disturbs both, so the minutes are compared one by one.

    """
    minutes = [
        [sum(window['overruns'] for window in each) for each in _minutes(its)]
        for its in (ours, theirs)
    ]
    more = np.array([a - b for a, b in zip(*minutes, strict=False)], dtype=float)
    if len(more) < 2:
        return float(np.sum(more)), float('nan')
    return float(more.mean()), float(more.std(ddof=1) / np.sqrt(len(more)))


def _minutes(windows: Sequence[Window]) -> list[Sequence[Window]]:
    """Return whole minutes of windows of a second."""
    return [windows[i : i + 60] for i in range(0, len(windows) - 59, 60)]


def chunks_in(path: Path) -> int:
    """Return how many chunks a recording has."""
    with path.open('rb') as file:
        summary = make_reader(file).get_summary()
    assert summary is not None, 'a finished recording has one'
    return len(summary.chunk_indexes)


def holes_in(path: Path) -> int:
    """Return how many positions a recording lacks, by their stamps."""
    stamps = [time_ns for _, time_ns, _ in Recording(path).messages(['position'])]
    return int(np.sum(np.diff(stamps) // BLOCK_NS - 1))


def _watch(
    programs: Sequence[Program], sizes: Sizes
) -> tuple[list[list[float]], list[list[Window]]]:
    """Take memory and lateness at equal intervals."""
    memory_bytes: list[list[float]] = [[] for _ in programs]
    windows: list[list[Window]] = [[] for _ in programs]
    begin_s = time.monotonic()
    for number in range(1, 1 + round(sizes.soak_s / sizes.sample_s)):
        time.sleep(max(0.0, begin_s + number * sizes.sample_s - time.monotonic()))
        for i, program in enumerate(programs):
            memory_bytes[i].append(float(program.process.resident_bytes()))
            its = program.windows()
            windows[i] = windows[i] + its if isinstance(program, BareLoop) else its
    return memory_bytes, windows


def _memory_row(memory_bytes: Sequence[float], period_s: float) -> Row:
    after = memory_bytes[int(WARM_UP_SHARE * len(memory_bytes)) :]
    slope, error = growth_of(after, period_s / 60.0)
    return {
        'memory_MB': after[0] / MEGA,
        'memory_at_end_MB': after[-1] / MEGA,
        'growth_kB_per_min': slope / KILO,
        'its_error': error / KILO,
    }


def _lateness_row(windows: Sequence[Window]) -> Row:
    late = summary(windows)
    return {'ticks': late['ticks'], 'overruns': late['overruns'], 'p99_late_us': late['p99_us']}


def _verdicts(rows: Sequence[Row], excess: tuple[float, float], lost: int) -> list[Verdict]:
    """Judge; what two equal programs would differ by, by chance, is no miss."""
    node, bare = rows
    growth = float(node['growth_kB_per_min']) - float(bare['growth_kB_per_min'])
    growth_error = float(np.hypot(float(node['its_error']), float(bare['its_error'])))
    missing = int(node['missing_at_subscriber'])
    return [
        _at_most_by_chance(
            'growth of memory beyond that of the bare loop, kB per minute', growth, growth_error
        ),
        _at_most_by_chance('overruns beyond those of the bare loop, per minute', *excess),
        Verdict('readings missing at the subscriber', 0, missing, at_most=True),
        Verdict('messages missing in the recording', 0, lost, at_most=True),
    ]


def _at_most_by_chance(what: str, more: float, error: float) -> Verdict:
    least = max(0.0, more - SIGMAS * error)
    return Verdict(f'{what}, less {SIGMAS:g} standard errors', 0.0, least, at_most=True)
