# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The paper's figures and open questions: runs, tables, pictures, captions."""
