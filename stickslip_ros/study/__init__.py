"""What an experimenter does with the drive, without ROS."""
