"""A twin beside a rig: a fitted stand that is driven by what drives the rig, and its health."""
