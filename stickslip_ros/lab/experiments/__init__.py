"""Experiments: what drove a stand, what was seen, and what a model says would be seen."""
