"""Parameters of the oscilloscope and of recordings."""

from dataclasses import dataclass

from stickslip_ros.parameters.fields import (
    ASSUMED,
    Checked,
    choice,
    count,
    quantity,
    switch,
    words,
)


@dataclass(frozen=True)
class TraceParameters(Checked):
    """The oscilloscope: blocks of samples on one topic."""

    sample_rate: float = quantity(
        50e3, 'Hz', 1e3, 1e6, ASSUMED, 'sampling of voltage, foot, position and force'
    )
    period: float = quantity(
        0.01, 's', 1e-4, 1.0, ASSUMED, 'time per message of trace and of voltage'
    )


@dataclass(frozen=True)
class RecordParameters(Checked):
    """Where and how runs are kept."""

    on_start: bool = switch(False, ASSUMED, 'record from the activation on')
    directory: str = words('runs', ASSUMED, 'folder of the recordings')
    name: str = words('', ASSUMED, 'file name; empty names it after date and time')
    format: str = choice(
        'file',
        ('file', 'bag'),
        ASSUMED,
        'one MCAP file, or a directory with metadata.yaml as ros2 bag makes it',
    )
    compression: str = choice(
        'zstd', ('zstd', 'lz4', 'none'), ASSUMED, 'compression of the chunks'
    )
    chunk_size: int = count(1 << 20, 'B', 1 << 10, 1 << 28, ASSUMED, 'size of a chunk')
    queue_length: int = count(
        20_000,
        '',
        10,
        10_000_000,
        ASSUMED,
        'messages that may wait for the disk before one is dropped',
    )
    flush_period: float = quantity(
        1.0, 's', 0.01, 60.0, ASSUMED, 'what is older, by the clock, is safe on the disk'
    )
    split_size: int = count(
        0, 'B', 0, 1 << 40, ASSUMED, 'size at which the run goes on in a next file; 0: never'
    )
    split_duration: float = quantity(
        0.0,
        's',
        0.0,
        1e9,
        ASSUMED,
        'simulated time after which the run goes on in a next file; 0: never',
    )
    experiment: str = words(
        '', ASSUMED, 'CSV of an experiment that each recording carries, to be compared with it'
    )
