# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Drawings of the stand: geometry, SVG, film and URDF."""
