"""The periodic wave that does best: shapes, what a wave is worth, and the search for it."""
