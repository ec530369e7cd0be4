# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Experiments: what drove a stand, what was seen, and what a model says would be seen."""
