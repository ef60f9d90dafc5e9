"""Kernels that simulate walks."""

from typing import Final, Literal

Precision = Literal["single", "double"]
"""Of the compiled physics. Positions, sums and control are in double precision in both."""

LARGEST_DELAY: Final = 15
"""Of a sensor [control ticks]."""
