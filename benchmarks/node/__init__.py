"""Benchmarks of the node against bare rclpy programs: what they send and what they cost."""
