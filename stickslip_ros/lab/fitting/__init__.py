"""Parameters of the drive from measured forces: weighted least squares with error bars."""
