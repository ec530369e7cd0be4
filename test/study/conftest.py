"""One recorded saw-tooth run that the tests of studies share."""

from pathlib import Path

import pytest

from stickslip_ros.parameters import Parameters
from stickslip_ros.study.sawtooth_run import SawtoothRun, simulate


@pytest.fixture(scope='session')
def recorded_run(tmp_path_factory: pytest.TempPathFactory) -> tuple[SawtoothRun, Path]:
    """Give result and recording of twenty full steps at 1 kHz, with the default stand."""
    path = tmp_path_factory.mktemp('study') / 'run.mcap'
    return simulate(Parameters(), voltage_v=300.0, steps=20, path=path).result, path
