"""What must be settled before rclpy starts."""

import os

DISCOVERY_VARIABLE = 'ROS_AUTOMATIC_DISCOVERY_RANGE'


def stay_on_this_host() -> None:
    """Limit discovery to this host, unless the user has chosen a range; an empty one is none."""
    if not os.environ.get(DISCOVERY_VARIABLE):
        os.environ[DISCOVERY_VARIABLE] = 'LOCALHOST'
