"""The panel from start to end: a drive or a recording, and the server of its page."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

from stickslip_ros.extras import load_extra
from stickslip_ros.panel.controls import lamps, sheet


def run_panel(
    file: Path | None, namespace: str, port: int, on_start: Callable[[str], None]
) -> None:
    """
    Serve the panel until the end is asked for (see `stopping`).

    Parameters
    ----------
    file : Path or None
        A recording; None attaches to a drive.
    namespace : str
        Of the drive.
    port : int
        TCP port on this host; 0 takes a free one.
    on_start : callable
        Receives the address.

    Raises
    ------
    StickSlipError
        If the package of the server is missing, the recording cannot be read, or the port is
        taken.
    KeyboardInterrupt
        At the end.

    """
    load_extra('the panel', 'tornado')
    from stickslip_ros.panel.server import serve  # noqa: PLC0415 - needs the extra

    source: Any
    if file is None:
        from stickslip_ros.panel.link import Link  # noqa: PLC0415 - a recording needs no ROS

        source, told = Link(namespace), sheet()
    else:
        from stickslip_ros.panel.player import Player  # noqa: PLC0415 - nor a drive numba

        source = Player(file)
        told = {'kind': 'recording', **lamps(), 'run': source.overview()}
    serve(source, told, port, on_start)
