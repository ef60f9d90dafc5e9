"""Interface of motor controllers: variables, published designs, and the compiled control law."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from importlib import resources
from typing import NamedTuple, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from gaitswarm.sim.arrays import Ints
from gaitswarm.sim.controllers.fixed_point import FRACTION_BITS, descale
from gaitswarm.sim.controllers.mamdani import Mamdani
from gaitswarm.sim.controllers.quantisation import Axis
from gaitswarm.sim.errors import SimulationInputError
from gaitswarm.sim.variables import Variable


@dataclass(frozen=True, slots=True, eq=False)
class LookupTable:
    """A quantised function of error, current and velocity error, as stored in the microcontroller.

    Gains have 16 fractional bits and shifts round half up; indices are clamped: i_error = n_error /
    2 + (error * error_gain) >> 16, i_current = (current * current_gain) >> 16, i_velocity =
    n_velocity / 2 + (change * velocity_gain) >> 16, where change is that of the error over one
    tick. The output is value * output_gain.

    Attributes:
        values: (n_error, n_current, n_velocity) int8, sizes a power of two each, 1 for an unused
            input.
        output_gain: per value.
        error_gain: index per count of error.
        current_gain: index per count of current.
        velocity_gain: index per count of change.
    """

    values: NDArray[np.int8]
    output_gain: int
    error_gain: int
    current_gain: int
    velocity_gain: int = 0

    def __post_init__(self) -> None:
        if self.values.ndim != 3 or not self.values.size:
            raise SimulationInputError(
                f"values: table of shape {self.values.shape}; it needs three axes, none empty"
            )

    def respond(self, error: Ints, current: Ints, change: Ints) -> Ints:
        """Look up the outputs (J,), with the fraction bits of `output_gain`.

        Args:
            error: Coded angle errors, (J,) [counts].
            current: Coded absolute currents, (J,) [counts].
            change: Of the errors over one tick, (J,) [counts].
        """
        rows, columns, layers = self.values.shape
        row = np.clip(descale(error * self.error_gain, FRACTION_BITS) + rows // 2, 0, rows - 1)
        column = np.clip(descale(current * self.current_gain, FRACTION_BITS), 0, columns - 1)
        layer = descale(change * self.velocity_gain, FRACTION_BITS) + layers // 2
        entry = self.values[row, column, np.clip(layer, 0, layers - 1)]
        output: Ints = entry.astype(np.int64) * self.output_gain
        return output


class Response(Protocol):
    """A function used by a control law: a table, or for comparison the inference behind it."""

    def respond(self, error: Ints, current: Ints, change: Ints) -> Ints:
        """Return the outputs (J,) in fixed point.

        Args:
            error: Coded angle errors, (J,) [counts].
            current: Coded absolute currents, (J,) [counts].
            change: Of the errors over one tick, (J,) [counts].
        """


class JointPd(NamedTuple):
    """PD of torque-controlled actuators, at their own rate between control ticks.

    tau = stiffness (q_d - q) + damping (dq_d - dq) + feed_forward tau_ff, added to the torque
    commanded by the rest of the control law.

    Attributes:
        stiffness: K_p [N m/rad].
        damping: K_d [N m s/rad].
        feed_forward: share of the torque with which the joint carries the robot [1].
    """

    stiffness: float = 0.0
    damping: float = 0.0
    feed_forward: float = 0.0


@dataclass(frozen=True, slots=True, eq=False)
class ControlLaw:
    """A compiled controller: integers only, errors and PWM in coded counts.

    Full scale of its output is the voltage of a DC motor's bridge, or the torque limit of a
    torque-controlled actuator.

    With change that of the error over one tick, the direct part is the sum of error *
    proportional_gain, change * derivative_gain and the output of `direct`, >> 16; the integral part
    is the sum over ticks of error * integral_gain and the output of `integrated`, clamped to the
    PWM's range, >> 32.

    Attributes:
        proportional_gain: with 16 fraction bits.
        integral_gain: with 32 fraction bits.
        derivative_gain: with 16 fraction bits.
        joint_pd: of torque-controlled actuators, in floating point.
        servo: P of position-controlled servos [units of their register].
    """

    proportional_gain: int = 0
    integral_gain: int = 0
    derivative_gain: int = 0
    direct: Response | None = None
    integrated: Response | None = None
    joint_pd: JointPd | None = None
    servo: float | None = None

    @property
    def inner(self) -> tuple[float, float, float]:
        """Numbers of the actuators' own control: those of the joint PD, or P and 1 of servos."""
        if self.servo is not None:
            return self.servo, 1.0, 0.0
        pd = self.joint_pd or JointPd()
        return pd.stiffness, pd.damping, pd.feed_forward


class Universe(NamedTuple):
    """An input or output of a fuzzy inference, which computes with shares of it.

    Attributes:
        unit: of its values.
        full_range: share 1, in the unit.
        counts: coded counts per unit, as used by a table.
    """

    name: str
    unit: str
    full_range: float
    counts: float = 1.0


class Inference(NamedTuple):
    """One output of a fuzzy controller: the inference, and the table that replaces it on the robot.

    Attributes:
        inputs: in the system's order.
        axes: of the table, by input.
    """

    output: Universe
    inputs: Mapping[str, Universe]
    system: Mamdani
    axes: Mapping[str, Axis]
    table: LookupTable


@lru_cache(maxsize=1)
def _published() -> Mapping[str, Mapping[str, Mapping[str, float]]]:
    file = resources.files("gaitswarm.sim.controllers") / "published.toml"
    return tomllib.loads(file.read_text(encoding="utf-8"))


def published_designs(controller: str) -> Mapping[str, Mapping[str, float]]:
    """Return designs from the literature, by the preference or study that they belong to."""
    return _published().get(controller, {})


def names_of(controller: Controller) -> frozenset[str]:
    """All design variables and conventions of a controller."""
    return frozenset(v.name for v in (*controller.variables, *controller.conventions))


@runtime_checkable
class Controller(Protocol):
    """A family of controllers, parametrised by design variables."""

    @property
    def name(self) -> str:
        """As in job specs and on the command line."""

    @property
    def description(self) -> str:
        """A sentence with its source."""

    @property
    def variables(self) -> tuple[Variable, ...]:
        """Design variables with bounds and units; a design gives a value for each."""

    @property
    def conventions(self) -> tuple[Variable, ...]:
        """Choices that the thesis leaves open, with the defaults for designs that omit them."""

    @property
    def published(self) -> Mapping[str, Mapping[str, float]]:
        """Designs from the literature, by the preference or study that they belong to."""

    def compile(self, design: Mapping[str, float]) -> ControlLaw:
        """Compile a design to the integers that run on the robot.

        Args:
            design: Value of every variable by name.

        Raises:
            SimulationInputError: A value is missing or cannot be represented; names the variable.
        """

    def inferences(self, design: Mapping[str, float]) -> tuple[Inference, ...]:
        """Return the fuzzy inferences behind a design's tables, by output.

        Args:
            design: Value of every variable by name.

        Raises:
            SimulationInputError: A value is missing or cannot be represented; names the variable.
        """
