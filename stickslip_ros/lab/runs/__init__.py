"""Runs without ROS: simulate, sweep, 0-amplitude, replay, and their figures."""
