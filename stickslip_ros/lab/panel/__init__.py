# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The front panel: a page in the browser, and a server on this host that feeds it."""
