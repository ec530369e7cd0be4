"""What must be settled before rclpy starts."""

import os

DISCOVERY_VARIABLE = 'ROS_AUTOMATIC_DISCOVERY_RANGE'


def stay_on_this_host() -> None:
    """Limit discovery to this host, unless the user has chosen a range."""
    os.environ.setdefault(DISCOVERY_VARIABLE, 'LOCALHOST')
