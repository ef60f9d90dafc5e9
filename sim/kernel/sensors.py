"""Sensor errors before coding: the Python twin of sensors.c, number by number"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from gaitswarm.sim.arrays import Floats
from gaitswarm.sim.errors import SimulationInputError
from gaitswarm.sim.kernel import LARGEST_DELAY

Words = NDArray[np.uint64]
Integers = NDArray[np.int64]

_BYTES: Final = 8
"""Number of bytes whose sum is a reading's noise (Irwin-Hall distribution): exact, and normal
except for the tails, which end at 4.9 standard deviations."""

_MEAN: Final = _BYTES * 255 // 2

DEVIATION: Final = math.sqrt(_BYTES * (256**2 - 1) / 12.0)
"""Standard deviation of such a sum."""

_WORD: Final = np.uint64(0xFFFFFFFF)
_MULTIPLIERS: Final = np.uint64(0xD2511F53), np.uint64(0xCD9E8D57)
_WEYL: Final = 0x9E3779B9, 0xBB67AE85


@dataclass(frozen=True, slots=True)
class SensorErrors:
    """Errors of all joints' encoders and current sensors in one walk."""

    angle_noise: float = 0.0  # standard deviation [rad]
    current_noise: float = 0.0  # standard deviation of an absolute current [A]
    angle_delay: int = 0  # [control ticks]
    current_delay: int = 0  # [control ticks]
    seed: int = 0  # of the noise, which depends on seed, tick and joint only

    def __post_init__(self) -> None:
        for name in ("angle_noise", "current_noise"):
            if not 0.0 <= getattr(self, name) < math.inf:
                raise SimulationInputError(f"{name}: {getattr(self, name):g} must be at least 0")
        for name in ("angle_delay", "current_delay"):
            if not 0 <= getattr(self, name) <= LARGEST_DELAY:
                raise SimulationInputError(
                    f"{name}: {getattr(self, name)} must be 0 to {LARGEST_DELAY} control ticks"
                )
        if not 0 <= self.seed < 2**64:
            raise SimulationInputError(f"seed: {self.seed} must be 0 to 2^64 - 1")

    @property
    def scales(self) -> tuple[float, float]:
        """Noise of angle [rad] and current [A] per unit of a sum of bytes."""
        return self.angle_noise / DEVIATION, self.current_noise / DEVIATION

    @property
    def delays(self) -> tuple[int, int]:
        """Of angle and current [control ticks]."""
        return self.angle_delay, self.current_delay


NO_ERRORS: Final = SensorErrors()


def philox(counter: Words, key: tuple[Words, Words]) -> Words:
    """Philox4x32-10 (Salmon et al., Parallel random numbers: as easy as 1, 2, 3, 2011)."""
    c = [counter[..., k] for k in range(4)]
    shift = np.uint64(32)
    for number in range(10):
        keys = [(k + np.uint64(number * w)) & _WORD for k, w in zip(key, _WEYL, strict=True)]
        a, b = c[0] * _MULTIPLIERS[0], c[2] * _MULTIPLIERS[1]
        c = [(b >> shift) ^ c[1] ^ keys[0], b & _WORD, (a >> shift) ^ c[3] ^ keys[1], a & _WORD]
    return np.stack(c, axis=-1)


def byte_sums(seeds: Words, tick: int, joints: int, stream: int = 0) -> Integers:
    """Return nearly normal integers (n, J, 2), two for every joint, from 64-bit seeds (n,)."""
    counter = np.zeros((len(seeds), joints, 4), dtype=np.uint64)
    counter[..., 0], counter[..., 1], counter[..., 2] = tick, np.arange(joints), stream
    column = seeds[:, np.newaxis]
    words = philox(counter, (column & _WORD, column >> np.uint64(32))).astype(np.uint32)
    each = words.view(np.uint8).reshape(len(seeds), joints, 2, _BYTES)
    return np.asarray(each.sum(axis=-1, dtype=np.int64) - _MEAN)


class Sensors:
    """Sensors of one walk, tick by tick."""

    def __init__(self, errors: SensorErrors) -> None:
        self._errors = errors
        self._delayed = [deque[Floats](maxlen=delay + 1) for delay in errors.delays]
        self._tick = 0

    def read(self, angle: Floats, current: Floats) -> tuple[Floats, Floats]:
        """Return the next tick's readings of angles (J,) [rad] and absolute currents (J,) [A]."""
        noise = self._noise(len(angle))
        self._tick += 1
        seen = []
        for exact, error, delayed in zip((angle, current), noise, self._delayed, strict=True):
            delayed.append(exact + error)
            seen.append(delayed[0])
        return seen[0], seen[1]

    def _noise(self, joints: int) -> tuple[Floats | float, Floats | float]:
        """Noise of angles and currents, (J,) each; no random number is drawn without noise."""
        of_angle, of_current = self._errors.scales
        if not (of_angle or of_current):
            return 0.0, 0.0
        seed = np.array([self._errors.seed], dtype=np.uint64)
        (sums,) = byte_sums(seed, self._tick, joints)
        return sums[:, 0] * of_angle, sums[:, 1] * of_current
