"""The linear drive: state space, Bode, swept sine."""
