"""The virtual instrument: a pure function of time and requests."""
