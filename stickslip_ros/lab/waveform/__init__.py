# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Recognise the wave of a drive in samples of its voltage, or refuse the samples."""
