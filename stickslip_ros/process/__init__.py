"""How a process starts, is asked to stop, and ends with which status."""
