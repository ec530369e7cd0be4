# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Start and end of a process: signals, requests to stop, exit status."""
