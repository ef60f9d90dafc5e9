"""What a motor controller is to the rest: variables to tune, published values, a compiled drive."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from sim.variables import Variable

ERROR_BITS = 10
CURRENT_BITS = 6
TABLE_SHAPE = (1 << ERROR_BITS, 1 << CURRENT_BITS)


@dataclass(frozen=True, slots=True, eq=False)
class Drive:
    """A controller as the microcontroller runs it: integers only.

    Proportional part in PWM counts: (table[i_e, i_c] * output_gain) >> 16 where the table is
    given, else (error * proportional_gain) >> 16. Integral part: the sum over ticks of
    (error * integral_gain), clamped to the PWM range, >> 20. Shifts round half up.

    table: (1024, 64) int8, or None.
    error_gain, current_gain: index scale, 16 fractional bits: i_e = 512 + (error * error_gain)
        >> 16, i_c = (current * current_gain) >> 16, each clamped to the table.
    """

    proportional_gain: int = 0
    integral_gain: int = 0
    table: NDArray[np.int8] | None = field(default=None, repr=False)
    error_gain: int = 0
    current_gain: int = 0
    output_gain: int = 0


class Controller(Protocol):
    """A family of controllers, parametrised by design variables."""

    @property
    def name(self) -> str:
        """As in job specs and on the command line."""

    @property
    def description(self) -> str:
        """What it is, with its source."""

    @property
    def variables(self) -> tuple[Variable, ...]:
        """Design variables with bounds and units."""

    @property
    def published(self) -> Mapping[str, Mapping[str, float]]:
        """Designs from the literature, by the preference or study that they belong to."""

    def compile(self, design: Mapping[str, float]) -> Drive:
        """Integers for the kernel. Raises SimulationInputError that names the variable."""
