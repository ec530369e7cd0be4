"""Drives beside the tests, from stickslip_ros."""

pytest_plugins = ['stickslip_ros.testing.pytest_plugin']
