"""Contexts of rclpy for tests, in a module whose name no other folder of tests has."""

import rclpy
from rclpy.context import Context
from rclpy.signals import SignalHandlerOptions


def open_context(domain: int, namespace: str, rules: tuple[str, ...] = ()) -> Context:
    """Give a context of rclpy whose nodes live in a namespace, under these remapping rules."""
    context = Context()
    rules = (f'__ns:={namespace}', *rules) if namespace else rules
    arguments = ['--ros-args', *(word for rule in rules for word in ('-r', rule))] if rules else []
    rclpy.init(
        args=arguments,
        context=context,
        domain_id=domain,
        signal_handler_options=SignalHandlerOptions.NO,
    )
    return context
