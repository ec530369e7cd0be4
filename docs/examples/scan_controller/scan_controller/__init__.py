"""Holds a stick-slip stage at a position by the voltage of its piezos."""
