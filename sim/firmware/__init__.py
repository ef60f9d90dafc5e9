"""A design as C for a microcontroller, with simulated walks that it must reproduce exactly."""

from __future__ import annotations

from gaitswarm.sim.firmware.folder import (
    FORMAT,
    MANIFEST,
    Firmware,
    check_drives_by_pwm,
    check_table_bits,
    firmware_of,
    parsed_table_bits,
)
from gaitswarm.sim.firmware.memory import BUDGET, Memory

__all__ = [
    "BUDGET",
    "FORMAT",
    "MANIFEST",
    "Firmware",
    "Memory",
    "check_drives_by_pwm",
    "check_table_bits",
    "firmware_of",
    "parsed_table_bits",
]
