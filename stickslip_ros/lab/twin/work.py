# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The threads of a twin: one compares and publishes windows, one fits some of them."""

import queue
import threading
import traceback
from collections.abc import Callable, Sequence
from concurrent.futures import Future, ThreadPoolExecutor

import numpy as np

from stickslip_ros.errors import StickSlipError
from stickslip_ros.interface.cdr import pack_float64_array, pack_stamped
from stickslip_ros.lab.twin.health import Doctor, Health
from stickslip_ros.lab.twin.settings import TwinParameters
from stickslip_ros.lab.twin.twin import Look, RigAtRest, Twin
from stickslip_ros.lab.twin.window import Window
from stickslip_ros.message_types import FLOAT64_ARRAY, POINT_STAMPED, WRENCH_STAMPED
from stickslip_ros.parameters import Parameters
from stickslip_ros.process.stopping import Stopped
from stickslip_ros.units import NS_PER_S

TWIN_OUTPUTS = {
    'twin/position': POINT_STAMPED,
    'twin/residual': POINT_STAMPED,
    'twin/foot_position': POINT_STAMPED,
    'twin/force': WRENCH_STAMPED,
    'twin/steps': FLOAT64_ARRAY,
    'twin/parameters': FLOAT64_ARRAY,
}
"""Topics of a twin."""
_THINNED_NS = 1_000_000  # least time between messages on a topic of the twin, ns
_WAITING = 20  # most waiting windows; further ones are dropped
_BEHIND = 5  # number of waiting windows from which no fit starts


class Work:
    """
    Two threads of a twin: one compares windows, one fits them.

    ``health`` is the result of the last fit, ``trouble`` the error of the last window. ``shown``,
    ``dropped``, ``fits`` and ``left_out`` count windows with motion, windows lost to a full queue,
    fits and skipped fits. ``publish`` is called with a topic of TWIN_OUTPUTS and a message,
    ``tell`` with a warning.

    """

    def __init__(
        self,
        stand: Parameters,
        settings: TwinParameters,
        publish: Callable[[str, bytes], None],
        tell: Callable[[str], None],
    ) -> None:
        self._publish, self._tell = publish, tell
        self._twin = Twin(stand, settings)
        self._doctor = Doctor(self._twin, settings)
        self._queue: queue.Queue[Window | None] = queue.Queue()
        self._fits = ThreadPoolExecutor(1, 'fits of the twin')
        self._fitting: Future[None] | None = None
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
            self._publish('twin/parameters', _row('fit', labels, row))
        except (Stopped, KeyboardInterrupt):
            return
        except StickSlipError as error:
            self._tell(f'no fit: {error}')
            none = np.empty(0)
            self.health = Health(look.window.end_ns, (), none, none, np.nan, f'no fit: {error}')
        except Exception:  # noqa: BLE001 - no caller waits
            self._tell(f'a fit has failed:\n{traceback.format_exc()}')

    def _show(self, look: Look) -> None:
        """Publish the twin in a window, thinned."""
        for each in look.shown:
            name = each.quantity.rpartition('_')[0]
            stamps_ns = look.window.start_ns + np.round(each.time_s * NS_PER_S).astype(np.int64)
            _, first = np.unique(stamps_ns // _THINNED_NS, return_index=True)
            shown = {f'twin/{name}': each.twin}
            if name == 'position':
                shown['twin/residual'] = each.rig - each.twin
            for key, values in shown.items():
                zeros = (0.0,) * (5 if TWIN_OUTPUTS[key] == WRENCH_STAMPED else 2)
                for at in first.tolist():
                    numbers = float(values[at]), *zeros
                    self._publish(key, pack_stamped(int(stamps_ns[at]), '', numbers))
        labels = ['t[s]', 'steps', 'rig[m]', 'twin[m]', 'residual_rms[m]']
        step_m = look.step_rig_m, look.step_twin_m
        row = [look.window.end_ns / NS_PER_S, look.steps, *step_m, look.shown[0].rms]
        self._publish('twin/steps', _row('window', labels, row))


def _row(axis: str, labels: Sequence[str], row: Sequence[float]) -> bytes:
    return pack_float64_array(np.array([row]), (axis, ','.join(labels)))
