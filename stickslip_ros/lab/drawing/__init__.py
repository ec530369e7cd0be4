# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The stand as one sees it: where its parts are, as a drawing, as a film and as a URDF."""
