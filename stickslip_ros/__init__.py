"""A virtual stick-slip microdrive for ROS 2, computed from rough-contact mechanics."""

__version__ = '0.1.0'
