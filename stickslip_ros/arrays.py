# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Type of the arrays that the package computes with."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
