# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Experiments: the drive of a stand, its readings, and the predictions of a model."""
