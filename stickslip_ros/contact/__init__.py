# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""One hemisphere against the runner: normal force, roughness, presliding and its memory."""
