"""Two runs, sweeps or experiments side by side: how far they differ, in numbers with units."""
