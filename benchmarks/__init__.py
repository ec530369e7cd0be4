"""What the drive is compared with, and how fast it is: ``python -m benchmarks``."""
