"""PI and Fuzzy-PI in the robot's integers, implemented independently from docs/model.md."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from gaitswarm.sim.controllers.fuzzy_pi import CURRENT, ERROR, inference_system
from gaitswarm.sim.controllers.mamdani import Shape
from gaitswarm.sim.controllers.quantisation import quantised
from gaitswarm.sim.kernel.observation import WalkLog
from gaitswarm.sim.robot.robot import Robot
from tests.mujoco.walker import CONTROL_PERIOD, Floats

Ints = NDArray[np.int64]


class Coded(ABC):
    """Sensors, integrator and bridge around a proportional part."""

    def __init__(self, robot: Robot, log: WalkLog, design: Mapping[str, float]) -> None:
        d = robot.description
        assert d.pwm is not None
        assert d.supply.nominal_voltage is not None
        self._sensors, self._pwm = d.sensors, d.pwm
        self._full_duty = d.pwm.full_scale / d.supply.nominal_voltage
        self._desired = np.rint(log.desired_angle * d.sensors.angle_counts).astype(np.int64)
        # 32 fractional bits.
        self._integral_gain = round(design["I"] * CONTROL_PERIOD * 2**32)
        self._integral = np.zeros(robot.n_joints, dtype=np.int64)

    def __call__(self, tick: int, angles: Floats, current: Floats) -> Floats:
        s, full = self._sensors, self._pwm.counts
        error = self._desired[tick] - _stepped(np.rint(angles * s.angle_counts), s.angle_step)
        load = _stepped(np.rint(current * s.current_counts), s.current_step)
        limit = full << 32
        self._integral = np.clip(self._integral + error * self._integral_gain, -limit, limit)
        output = self.proportional(error, load) + _shifted(self._integral, 32)
        counts = _stepped(np.clip(output, -full, full), self._pwm.step)
        return np.clip(counts, -full, full).astype(np.float64) * (self._full_duty / full)

    @abstractmethod
    def proportional(self, error: Ints, load: Ints) -> Ints:
        """PWM counts before the integrator's."""


class Pi(Coded):
    """P in PWM counts a count, with 16 fractional bits."""

    def __init__(self, robot: Robot, log: WalkLog, design: Mapping[str, float]) -> None:
        super().__init__(robot, log, design)
        self._gain = round(design["P"] * 2**16)

    def proportional(self, error: Ints, load: Ints) -> Ints:
        return _shifted(error * self._gain, 16)


class FuzzyPi(Coded):
    """The 10 x 6 bit table, whose middle row is zero error; its scales have 16 fractional bits."""

    def __init__(self, robot: Robot, log: WalkLog, design: Mapping[str, float]) -> None:
        super().__init__(robot, log, design)
        fw1, fw23, fw4, fw56 = (design[name] for name in ("FW1", "FW23", "FW4", "FW56"))
        system = inference_system(fw1, fw23, fw4, fw56, Shape(int(design["FOMF"])))
        table = quantised(system, {"error": ERROR, "current": CURRENT})
        self._table = table.values.astype(np.int64)
        self._row = round(511 / design["FI1R"] * 2**16)
        self._column = round(63 / design["FI2R"] * 2**16)
        self._output = round(design["FOR"] * table.largest / 127 * 2**16)

    def proportional(self, error: Ints, load: Ints) -> Ints:
        row = np.clip(512 + _shifted(error * self._row, 16), 0, 1023)
        column = np.clip(_shifted(load * self._column, 16), 0, 63)
        return _shifted(self._table[row, column] * self._output, 16)


def _shifted(value: Ints, bits: int) -> Ints:
    """Fixed point to integer, halves up."""
    return (value + (1 << (bits - 1))) >> bits


def _stepped(code: NDArray[np.number], step: int) -> Ints:
    """Nearest multiple of a resolution, halves up."""
    steps: Ints = np.floor(code / step + 0.5).astype(np.int64)
    return steps * step
