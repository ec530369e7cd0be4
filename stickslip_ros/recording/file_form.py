"""In what form a run is written: compression, chunks, parts, bag."""

from dataclasses import dataclass
from typing import Final

from stickslip_ros.units import NS_PER_S

CHUNKS_PER_PERIOD: Final = 3
"""Chunks that end in one flush period: the last one is then on the disk before it is over."""


@dataclass(frozen=True)
class FileForm:
    """
    In what form a run is written.

    Parameters
    ----------
    compression : str
        Of the chunks: ``zstd``, ``lz4`` or ``none``.
    chunk_size_bytes : int
        Size, before compression, at which a chunk is written.
    flush_period_s : float
        What is older than this, in wall-clock time, is on the disk.
    split_size_bytes : int
        Size at which a file ends and the next begins; 0 for never.
    split_duration_s : float
        Simulated time after which a file ends and the next begins; 0 for never.
    bag : bool
        Whether to make a directory with ``metadata.yaml``, as rosbag2 does.

    """

    compression: str = 'zstd'
    chunk_size_bytes: int = 512 * 1024
    flush_period_s: float = 1.0
    split_size_bytes: int = 0
    split_duration_s: float = 0.0
    bag: bool = False

    @property
    def chunk_period_ns(self) -> int:
        """Simulated time after which a chunk ends."""
        return max(1, round(self.flush_period_s * NS_PER_S / CHUNKS_PER_PERIOD))

    @property
    def split_duration_ns(self) -> int:
        """Simulated time after which a file ends; 0 for never."""
        return round(self.split_duration_s * NS_PER_S)

    @property
    def splits(self) -> bool:
        """Whether a run can have several files."""
        return self.split_size_bytes > 0 or self.split_duration_s > 0.0
