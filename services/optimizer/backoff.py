"""How long to wait before trying again, and when to give up."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Backoff:
    """Exponential backoff: `first` [s], doubled at each attempt up to `longest` [s].

    attempts: how often a failure is answered by another try before giving up.
    """

    first: float = 1.0
    longest: float = 60.0
    attempts: int = 8

    def delay(self, failures: int) -> float | None:
        """Seconds to wait after that many failures in a row (>= 1); None: give up."""
        if failures > self.attempts:
            return None
        # The exponent is bounded, so that a long row of attempts cannot overflow.
        return float(min(self.first * 2.0 ** min(failures - 1, 60), self.longest))
