"""A bench in real time: its thread, orders, pacing and lockstep; no ROS."""
