# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The recording of a rig that the pages name, made from the model."""

from pathlib import Path

import numpy as np

from stickslip_ros import Parameters, simulate
from stickslip_ros.interface.cdr import pack_float64, pack_stamped
from stickslip_ros.interface.channels import Channel, Qos
from stickslip_ros.message_types import FLOAT64, POINT_STAMPED
from stickslip_ros.recording.bag import write_metadata
from stickslip_ros.recording.recorder import Recorder

RIG = {
    'stand.preload': '350mN',
    'load_cell.contact': 'absent',
    'runner.damping': 15.0,
    'runner.mass': '3.2g',
}
WAVES = (
    *((60.0, 250.0, 1, 0.5), (170.0, 200.0, 1, 0.5)),
    *((280.0, 300.0, 6, 1.0), (300.0, 600.0, 8, 1.0)),
)
"""Of triangles and saw-teeth: volts, hertz, cycles, and the share of a cycle that rises."""
FALL_S, REST_S, NOISE_M = 2e-6, 3e-3, 1.5e-9


def corners() -> list[tuple[float, float]]:
    """Give times and voltages of the waves, with rests between them."""
    rows, now_s = [(0.0, 0.0), (REST_S, 0.0)], REST_S
    for volts, hertz, cycles, rise in WAVES:
        for _ in range(cycles):
            fall_s = max((1.0 - rise) / hertz, FALL_S)
            rows += [(now_s + 1.0 / hertz - fall_s, volts), (now_s + 1.0 / hertz, 0.0)]
            now_s += 1.0 / hertz
        now_s += REST_S
        rows.append((now_s, 0.0))
    return rows


def write_a_rig(path: Path) -> None:
    """Write what a rig records: voltage and position, on the topics that the pages name."""
    frame = simulate(Parameters().updated(RIG), waveform=corners(), steps=1).frame
    noise_m = np.random.default_rng(1).normal(0.0, NOISE_M, len(frame))
    topics = {'/rig/amplifier': FLOAT64, '/rig/encoder': POINT_STAMPED}
    with Recorder(path, [Channel(name, kind, Qos(1)) for name, kind in topics.items()]) as rig:
        for (time_s, row), error_m in zip(frame.iterrows(), noise_m, strict=True):
            time_ns = round(1e9 * float(str(time_s)))
            rig.put('/rig/amplifier', time_ns, pack_float64(row['voltage_v']), wait=True)
            place = pack_stamped(time_ns, '', (row['position_m'] + error_m, 0.0, 0.0))
            rig.put('/rig/encoder', time_ns, place, wait=True)


def write_a_bag(folder: Path) -> None:
    """Write the same as a bag directory."""
    part = folder / f'{folder.name}_0.mcap'
    folder.mkdir()
    write_a_rig(part)
    write_metadata(folder, [part])
