# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Helpers for tests of controllers: a drive, an operator, lockstep, pytest fixtures."""

from stickslip_ros.extras import needs_ros

with needs_ros('stickslip_ros.testing'):
    from stickslip_ros.ros.client import (
        Commands,
        Handshake,
        LockstepClient,
        open_context,
        stamp_ns,
    )
    from stickslip_ros.testing.operator import Operator, deep_queues
    from stickslip_ros.testing.stand import Stand, reserve_domain

__all__ = [
    'Commands',
    'Handshake',
    'LockstepClient',
    'Operator',
    'Stand',
    'deep_queues',
    'open_context',
    'reserve_domain',
    'stamp_ns',
]
