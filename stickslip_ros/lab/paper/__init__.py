"""The paper's figures, and what it leaves open: run, tabulated, drawn and captioned."""
