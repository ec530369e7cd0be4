"""Runs in MCAP files: written, read, recovered, as files and as bags of rosbag2."""
