"""What is settled before rclpy starts: the node stays on this host unless the user wants more."""

import os

import pytest

from stickslip_ros.ros.environment import DISCOVERY_VARIABLE, stay_on_this_host


@pytest.mark.parametrize(
    ('given', 'kept'), [(None, 'LOCALHOST'), ('', 'LOCALHOST'), ('SUBNET', 'SUBNET')]
)
def test_discovery_leaves_this_host_only_if_it_was_told_to(
    monkeypatch: pytest.MonkeyPatch, given: str | None, kept: str
):
    monkeypatch.setenv(DISCOVERY_VARIABLE, given or '')
    if given is None:
        monkeypatch.delenv(DISCOVERY_VARIABLE)
    stay_on_this_host()
    assert os.environ[DISCOVERY_VARIABLE] == kept
