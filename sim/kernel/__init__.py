"""Kernels that simulate walks."""

from typing import Literal

Precision = Literal["single", "double"]
"""Of the compiled physics. Positions, sums and control are in double precision in both."""
