# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The threads of a twin: windows are compared, published, recorded, and some are fitted."""

import queue
import threading
import traceback
from collections.abc import Callable, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from functools import partial

import numpy as np
import numpy.typing as npt

from stickslip_ros.arrays import Array
from stickslip_ros.errors import StickSlipError
from stickslip_ros.interface.cdr import pack_float64, pack_float64_array, pack_stamped
from stickslip_ros.interface.channels import Channel, Qos
from stickslip_ros.interface.topics import STREAM, TRACE
from stickslip_ros.lab.twin.health import Doctor, Health
from stickslip_ros.lab.twin.settings import TwinParameters
from stickslip_ros.lab.twin.twin import Look, RigAtRest, Twin
from stickslip_ros.lab.twin.window import Window
from stickslip_ros.message_types import FLOAT64, FLOAT64_ARRAY, POINT_STAMPED, WRENCH_STAMPED
from stickslip_ros.parameters import Parameters
from stickslip_ros.process.stopping import Stopped
from stickslip_ros.recording.recorder import Recorder
from stickslip_ros.recording.run_file import open_recorder, run_path
from stickslip_ros.units import NANO, NS_PER_S

TWIN_OUTPUTS = {
    'twin/position': POINT_STAMPED,
    'twin/residual': POINT_STAMPED,
    'twin/foot_position': POINT_STAMPED,
    'twin/force': WRENCH_STAMPED,
    'twin/steps': FLOAT64_ARRAY,
    'twin/parameters': FLOAT64_ARRAY,
}
"""Topics of a twin."""
_RIG_TYPES = {
    'voltage': FLOAT64,
    'position': POINT_STAMPED,
    'foot_position': POINT_STAMPED,
    'force': WRENCH_STAMPED,
    TRACE: FLOAT64_ARRAY,
}
"""Topics of the rig in a recording, named as those of a drive."""
_TRACED = {'voltage_v': 'voltage[V]', 'position_m': 'position[m]', 'force_n': 'force[N]'}
"""Quantities of a recorded trace, and their columns."""
_THINNED_NS = 1_000_000  # least distance of messages on a topic of the twin, ns
_WAITING = 20  # waiting windows, above which new ones are dropped
_BEHIND = 5  # waiting windows, from which no fit starts

_Messages = list[tuple[str, int, bytes]]  # key, stamp in ns, message
_Stamps = npt.NDArray[np.int64]


class Work:
    """
    Two threads of a twin: one compares and records windows, one fits them.

    ``health`` is that of the last fit, ``trouble`` the error of the last window. ``shown``,
    ``dropped``, ``fits`` and ``left_out`` count windows with motion, windows lost to a full queue,
    fits and skipped fits. ``publish`` takes a message of TWIN_OUTPUTS, ``tell`` a warning.

    """

    def __init__(
        self,
        stand: Parameters,
        settings: TwinParameters,
        publish: Callable[[str, bytes], None],
        tell: Callable[[str], None],
    ) -> None:
        self._stand, self._publish, self._tell = stand, publish, tell
        self._twin = Twin(stand, settings)
        self._doctor = Doctor(self._twin, settings)
        self._queue: queue.Queue[Window | None] = queue.Queue()
        self._fits = ThreadPoolExecutor(1, 'fits of the twin')
        self._fitting: Future[None] | None = None
        self._lock = threading.Lock()
        self._recorder: Recorder | None = None
        self._recorded_ns = self._origin_ns = 0  # last and first stamp of the recording
        self._namespace: str | None = None  # of a recording that starts with the next window
        self.health: Health | None = None
        self.trouble = ''
        self.shown = self.dropped = self.fits = self.left_out = 0
        self._thread = threading.Thread(target=self._run, name='windows of the twin', daemon=True)
        self._thread.start()

    def put(self, window: Window) -> None:
        """Queue a window, or drop it if too many wait."""
        if self._queue.qsize() >= _WAITING:
            self.dropped += 1
        else:
            self._queue.put(window)

    def close(self) -> None:
        """Finish the queue, and stop."""
        self._queue.put(None)
        self._thread.join()
        self._fits.shutdown()
        with self._lock:
            if self._recorder is not None:
                self._recorder.close()

    def set_recording(self, wanted: bool, namespace: str) -> str:
        """Start recording with the next window, or stop and return the path."""
        with self._lock:
            if wanted:
                self._namespace = namespace
                return 'the recording begins with the next window in which the rig moves'
            recorder, self._recorder, self._namespace = self._recorder, None, None
        if recorder is None:
            raise StickSlipError('nothing is recorded: the rig has not moved yet; move it first')
        recorder.close()
        return recorder.place

    def _run(self) -> None:
        while (window := self._queue.get()) is not None:
            try:
                look = self._twin.look(window)
                self.trouble = ''
                self.shown += 1
                self._show(look)
                if self._twin.is_due(look):
                    is_free = self._fitting is None or self._fitting.done()
                    if is_free and self._queue.qsize() < _BEHIND:
                        self._fitting = self._fits.submit(self._examine, look)
                    else:
                        self.left_out += 1
            except RigAtRest:  # noqa: PERF203 - the next windows go on
                self.trouble = ''
            except StickSlipError as error:
                self.trouble = str(error)
            except KeyboardInterrupt:  # Ctrl-C
                return
            except Exception:  # noqa: BLE001 - a thread has no caller
                self.trouble = traceback.format_exc(limit=-1)
                self._tell(f'a window has failed:\n{traceback.format_exc()}')

    def _examine(self, look: Look) -> None:
        try:
            health = self._doctor.examine(look)
            self.fits += 1
            if health.words and (self.health is None or not self.health.words):
                self._tell(health.words)
            self.health = health
            labels = ['t[s]', 'chi_square_per_reading']
            row = [health.stamp_ns / NS_PER_S, health.chi_per_reading]
            for name, value, sigma in zip(health.names, health.values, health.errors, strict=True):
                labels += [name, f'{name}_sigma']
                row += [float(value), float(sigma)]
            message = _row('fit', labels, row)
            self._publish('twin/parameters', message)
            with self._lock:  # later windows are recorded already
                self._record([('twin/parameters', self._recorded_ns, message)])
        except (Stopped, KeyboardInterrupt):
            return
        except StickSlipError as error:
            self._tell(f'no fit: {error}')
            none = np.empty(0)
            self.health = Health(look.window.end_ns, (), none, none, np.nan, f'no fit: {error}')
        except Exception:  # noqa: BLE001 - no caller waits
            self._tell(f'a fit has failed:\n{traceback.format_exc()}')

    def _show(self, look: Look) -> None:
        """Publish the twin in a window, thinned, and record it with the readings."""
        start_ns, messages = look.window.start_ns, _Messages()
        for each in look.shown:
            name = each.quantity.rpartition('_')[0]
            kind, stamps_ns = TWIN_OUTPUTS[f'twin/{name}'], _stamps(start_ns, each.time_s)
            messages += _packed(f'twin/{name}', kind, *_thinned(stamps_ns, each.twin))
            if name == 'position':
                residual = _thinned(stamps_ns, each.rig - each.twin)
                messages += _packed('twin/residual', kind, *residual)
        labels = ['t[s]', 'steps', 'rig[m]', 'twin[m]', 'residual_rms[m]']
        step_m = look.step_rig_m, look.step_twin_m
        row = [look.window.end_ns / NS_PER_S, look.steps, *step_m, look.shown[0].rms]
        messages.append(('twin/steps', look.window.end_ns, _row('window', labels, row)))
        for key, _, message in messages:
            self._publish(key, message)
        with self._lock:
            if self._namespace is not None:
                self._begin_recording(start_ns)
            if self._recorder is not None:
                messages += self._rig_messages(look.window)
                self._record(sorted(messages, key=lambda each: each[1]))

    def _rig_messages(self, window: Window) -> _Messages:
        """Return the readings of a window, as a trace if all share their stamps."""
        inside = {
            name: (_stamps(window.start_ns, time_s[time_s >= 0.0]), values[time_s >= 0.0])
            for name, (time_s, values) in window.samples.items()
        }
        stamps_ns, _ = inside['voltage_v']
        is_shared = all(np.array_equal(stamps_ns, each) for each, _ in inside.values())
        if is_shared and set(inside) <= set(_TRACED) and len(stamps_ns):
            columns = [(stamps_ns - self._origin_ns) * NANO, *(x for _, x in inside.values())]
            labels = ','.join(['t[s]', *(_TRACED[name] for name in inside)])
            block = pack_float64_array(np.column_stack(columns), ('sample', labels))
            return [(TRACE, window.end_ns, block)]
        messages = _Messages()
        for name, (stamps_ns, values) in inside.items():
            key = name.rpartition('_')[0]
            messages += _packed(key, _RIG_TYPES[key], stamps_ns, values)
        return messages

    def _begin_recording(self, start_ns: int) -> None:
        namespace, self._namespace = self._namespace, None
        channels = {
            key: Channel(f'{namespace}/{key}', kind, Qos(STREAM.depth))
            for key, kind in (_RIG_TYPES | TWIN_OUTPUTS).items()
        }
        path = run_path(self._stand, f'{namespace}/twin')
        self._recorder = open_recorder(path, self._stand, channels, start_ns)
        self._recorded_ns = self._origin_ns = start_ns

    def _record(self, messages: _Messages) -> None:
        """Record messages while recording; stop and warn on an error."""
        recorder = self._recorder
        if recorder is None:
            return
        problem = ''
        if messages[0][1] < self._recorded_ns:
            problem = 'the clock of the rig was set back'
        elif recorder.put_all(messages, wait=True) < len(messages):
            problem = str(recorder.error)
        self._recorded_ns = messages[-1][1]
        if problem:
            self._recorder = None
            recorder.close()
            self._tell(f'the recording has ended: {problem}')


def _stamps(start_ns: int, time_s: Array) -> _Stamps:
    return start_ns + np.round(time_s * NS_PER_S).astype(np.int64)


def _thinned(stamps_ns: _Stamps, values: Array) -> tuple[npt.NDArray[np.int64], Array]:
    """Return the first sample per _THINNED_NS."""
    _, first = np.unique(stamps_ns // _THINNED_NS, return_index=True)
    return stamps_ns[first], values[first]


def _packed(key: str, kind: str, stamps_ns: _Stamps, values: Array) -> _Messages:
    samples = zip(stamps_ns.tolist(), values.tolist(), strict=True)
    if kind == FLOAT64:
        return [(key, stamp_ns, pack_float64(value)) for stamp_ns, value in samples]
    zeros = (0.0,) * (5 if kind == WRENCH_STAMPED else 2)
    pack = partial(pack_stamped, frame_id='')
    return [(key, stamp_ns, pack(stamp_ns, values=(value, *zeros))) for stamp_ns, value in samples]


def _row(axis: str, labels: Sequence[str], row: Sequence[float]) -> bytes:
    return pack_float64_array(np.array([row]), (axis, ','.join(labels)))
