"""What the outside sees: topics, services, messages, and requests as bytes; no ROS."""
