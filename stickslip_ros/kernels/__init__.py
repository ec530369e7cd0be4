"""How functions become machine code, what they pass to each other, and where it is kept."""
