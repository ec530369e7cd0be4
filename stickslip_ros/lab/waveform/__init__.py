# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Reads the wave of a drive off samples of its voltage, or refuses them."""
