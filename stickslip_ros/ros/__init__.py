"""The node: the only package that speaks ROS."""
