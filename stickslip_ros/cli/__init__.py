"""The command ``stickslip``: each verb calls one function of the package."""

from stickslip_ros.cli.main import main

__all__ = ['main']
