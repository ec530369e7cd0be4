"""What each sensor of the table in ``parameters/sensors.py`` computes: a module of its name."""
