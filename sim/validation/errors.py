"""What is wrong with a measured log.

SimulationInputError
└── MeasuredLogError    a log that cannot be read or compared; names line, column and unit
"""

from __future__ import annotations

from sim.errors import SimulationInputError


class MeasuredLogError(SimulationInputError):
    """A measured log that cannot be used.

    line: counted from 1, as editors do, or None; column: heading with unit, as the file should
    have it, or None.
    """

    def __init__(self, problem: str, *, line: int | None = None, column: str | None = None) -> None:
        self.line = line
        self.column = column
        where = [] if line is None else [f"line {line}"]
        where += [] if column is None else [f"column '{column}'"]
        super().__init__(": ".join([*([", ".join(where)] if where else []), problem]))
