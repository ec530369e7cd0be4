"""The laboratory: runs, sweeps, fits, comparisons, figures, the panel and the command line."""
