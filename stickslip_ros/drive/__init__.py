"""The drive: a voltage in, a runner motion out."""
