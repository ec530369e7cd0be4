"""Contexts and queues for tests, in a module whose name no other folder of tests has."""

import rclpy
from rclpy.context import Context
from rclpy.signals import SignalHandlerOptions

KEPT = 10_000


def queues_of(*topics: str) -> dict[str, int]:
    """
    Give parameters with which a drive keeps all that a test hears of some topics.

    By default a hundred messages wait for whoever listens: on a machine that is busy a tenth of
    a second may pass in which DDS delivers nothing, and there is a hole.

    """
    return {f'qos_overrides./{topic}.publisher.depth': KEPT for topic in topics}


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
