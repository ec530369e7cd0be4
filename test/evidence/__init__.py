"""The codes that the references come from: ``make evidence``."""
