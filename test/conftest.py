"""What all tests share: how hypothesis searches, and the stand of the paper."""

import pytest
from hypothesis import HealthCheck, settings

from stickslip_ros.parameters import Parameters

# The same examples in every run and on every machine, however slow it is: a failure found once
# is found again, and a first call that compiles a kernel fails no deadline.
settings.register_profile(
    'deterministic',
    derandomize=True,
    deadline=None,
    database=None,
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.function_scoped_fixture],
)
settings.load_profile('deterministic')


@pytest.fixture(scope='session')
def stand() -> Parameters:
    """Give the test stand of the paper: every parameter at its default."""
    return Parameters()
