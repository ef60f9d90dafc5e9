"""What an autoscaler sees of the work that waits for slots."""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import suppress
from types import ModuleType
from typing import Any, Final

_LOOK_SECONDS: Final = 1.0
"""Between additions to what is shown."""

_WITHDRAWN_SECONDS: Final = 2.0
"""After the last addition, what is not wanted any more is withdrawn."""

_MOST: Final = 64
"""Further slots that an autoscaler is asked for at once, at most."""


class Demand:
    """Tasks that any node may run, by which an autoscaler sees that more slots would be used.

    It leaves out those that are sent to one node, as all walks are. These do nothing, and end as
    soon as they have a slot.

    Args:
        ray: The module, connected.
        clock: Monotonic time [s]; replaced in tests.
    """

    def __init__(self, ray: ModuleType, clock: Callable[[], float] = time.monotonic) -> None:
        self._ray = ray
        self._clock = clock
        # It is cancelled, perhaps when it has begun, and must not be in an import then.
        self._nothing = ray.remote(num_cpus=1, max_retries=0)(lambda: None)
        self._shown: list[Any] = []
        self._next = 0.0

    def show(self, slots: int) -> None:
        """Let so many tasks wait; to be called several times a second. Never waits.

        Args:
            slots: Further ones that would be used; 0 for none, which is shown after a while.
        """
        if self._shown:
            _, self._shown = self._ray.wait(self._shown, num_returns=len(self._shown), timeout=0.0)
        now = self._clock()
        if slots == 0:
            # What has a slot now ends by itself, and must not be cancelled in that instant: Ray
            # would end this process. What has none after a while is cancelled.
            if now >= self._next - _LOOK_SECONDS + _WITHDRAWN_SECONDS:
                self._withdraw()
        elif now >= self._next:
            self._next = now + _LOOK_SECONDS
            lacking = min(slots, _MOST) - len(self._shown)
            self._shown += [self._nothing.remote() for _ in range(lacking)]

    def _withdraw(self) -> None:
        for reference in self._shown:
            with suppress(self._ray.exceptions.RayError):
                self._ray.cancel(reference)
        self._shown = []
