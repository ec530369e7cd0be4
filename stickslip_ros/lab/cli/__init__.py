"""The command ``stickslip``: each verb calls one function of the package."""
