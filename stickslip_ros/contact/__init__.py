"""One hemisphere against the runner: normal force, roughness, presliding and its memory."""
