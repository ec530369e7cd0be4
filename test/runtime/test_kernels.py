"""A drive begins with the kernels of the ideal one; what needs others waits, and nothing else."""

import threading

import pytest

from stickslip_ros.instrument.commands import Request
from stickslip_ros.instrument.compilation import IDEAL_KERNELS, KERNELS, needs_all_kernels
from stickslip_ros.parameters import Parameters
from stickslip_ros.ros import diagnostics
from stickslip_ros.runtime import kernels
from stickslip_ros.runtime.kernels import Kernels, kernels_for
from stickslip_ros.runtime.session import Session

TIMEOUT_S = 180.0
PRELOAD = Request('preload', (0.6,))
VOLTAGE = Request('voltage', (30.0,))
UNPACED = {'sim.real_time_factor': 0.0}


@pytest.fixture
def waiting(monkeypatch, compiled_kernels):
    """Let sessions wait for kernels until they are told that these are ready."""
    monkeypatch.setattr(kernels, 'are_all_kept', lambda: False)
    monkeypatch.setattr(Kernels, '_follow', lambda self, process: process.wait())

    def ready(session):
        session.kernels.are_ready = True
        session.kernels._on_ready()

    return ready


def session_of(settings=None):
    return Session(Parameters().updated(settings or {}), lambda packed: None)


def test_a_process_of_its_own_compiles_and_hands_over(monkeypatch, compiled_kernels):
    monkeypatch.setattr(kernels, 'are_all_kept', lambda: False)
    told = threading.Event()
    drive = Kernels(Parameters(), told.set)
    assert drive.must_wait(PRELOAD, False)
    assert told.wait(TIMEOUT_S)
    assert drive.are_ready
    assert not drive.must_wait(PRELOAD, False)
    assert drive._process.returncode == 0


def test_its_process_ends_with_the_drive(waiting):
    drive = Kernels(Parameters(), lambda: None)
    drive.release()
    assert drive._process.wait(TIMEOUT_S) != 0
    assert not drive.are_ready


def test_only_preloads_and_faults_wait_and_what_must_not_overtake_them(waiting):
    drive = Kernels(Parameters(), lambda: None)
    drive.release()
    waits = {name for name in ('preload', 'fault') if drive.must_wait(Request(name), False)}
    assert waits == {'preload', 'fault'}
    for name in ('reset', 'clear_faults'):
        assert not drive.must_wait(Request(name), False)
        assert drive.must_wait(Request(name), True)
    for request in (None, VOLTAGE, Request('stop')):
        assert not drive.must_wait(request, True)


@pytest.mark.parametrize(
    ('settings', 'needs_all'),
    [
        ({}, False),
        ({'load_cell.contact': 'absent', 'contact.profile': 'rough_line'}, False),
        ({'amplifier.bandwidth': 2e5}, True),
        ({'contact.law': 'lugre'}, True),
        ({'load_cell.contact': 'one_sided'}, False),
        ({'actuator.gain_tolerance': 0.1}, True),
        ({'stand.preload_end': 0.3}, True),
        ({'fault.runner_stuck': True}, True),
        ({'fault.schedule': 'faults.yaml'}, True),
    ],
)
def test_stands_that_need_more_wait_for_all_kernels(settings, needs_all):
    parameters = Parameters().updated(settings)
    assert needs_all_kernels(parameters) == needs_all
    assert kernels_for(parameters) == (KERNELS if needs_all else IDEAL_KERNELS)


def test_a_paced_drive_goes_on_while_a_preload_waits_for_kernels(waiting):
    session = session_of()
    session.start()
    preload = session.submit(PRELOAD)
    reset = session.submit(Request('reset'))
    for _ in range(3):
        session.submit(VOLTAGE).result(TIMEOUT_S)
    assert session.held == 2
    told = diagnostics.drive_status('drive', session, diagnostics.Refusals(lambda: None))
    assert told.message == '2 commands wait for kernels, which are being compiled'
    assert not preload.done()
    assert not reset.done()
    waiting(session)
    assert preload.result(TIMEOUT_S) is None
    assert reset.result(TIMEOUT_S) is None
    assert session.held == 0
    session.stop()
    session.kernels.release()


def test_time_that_is_not_paced_waits_with_a_preload(waiting):
    session = session_of(UNPACED)
    session.start()
    session.submit(VOLTAGE).result(TIMEOUT_S)
    session.set_paused(wanted=True)
    preload, due_ns = session.submit(PRELOAD), session.bench.time_ns
    session.set_paused(wanted=False)
    assert session.held == 1
    assert session.bench.time_ns == due_ns
    waiting(session)
    preload.result(TIMEOUT_S)
    assert session.bench.plant.contacts[0].preload_n == 0.6
    session.stop()
    session.kernels.release()


def test_a_drive_that_waits_for_kernels_can_be_stopped(waiting):
    session = session_of(UNPACED)
    preload = session.submit(PRELOAD)
    session.start()
    session.stop()
    assert session.failure is None
    assert preload.cancelled()
    session.kernels.release()
