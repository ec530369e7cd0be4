"""Measured tables as laboratories have them: columns, layouts, units."""
