"""What a motor controller is to the rest: variables to tune, published values, a control law."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from gaitswarm.sim.controllers.fixed_point import FRACTION_BITS, descale
from gaitswarm.sim.controllers.mamdani import Mamdani
from gaitswarm.sim.controllers.quantisation import Axis
from gaitswarm.sim.errors import SimulationInputError
from gaitswarm.sim.variables import Variable

Ints = NDArray[np.int64]


@dataclass(frozen=True, slots=True, eq=False)
class LookupTable:
    """A quantised function of error, current and velocity error, as the microcontroller has it.

    Gains have 16 fractional bits and shifts round half up; indices clamp:
    i_error = n_error / 2 + (error * error_gain) >> 16, i_current = (current * current_gain) >> 16,
    i_velocity = n_velocity / 2 + (change * velocity_gain) >> 16, where change is the error's over
    one tick. The output is value * output_gain.

    Attributes:
        values: (n_error, n_current, n_velocity) int8, each a power of two, 1 for an input that
            does not matter.
        output_gain: of a value.
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
                f"values: a table of shape {self.values.shape}; it needs three axes, none empty"
            )

    def respond(self, error: Ints, current: Ints, change: Ints) -> Ints:
        """Look up what the table holds.

        Args:
            error: Coded angle errors, (J,) [counts].
            current: Coded absolute currents, (J,) [counts].
            change: Of the errors over one tick, (J,) [counts].

        Returns:
            Outputs (J,), with the fraction bits of `output_gain`.
        """
        rows, columns, layers = self.values.shape
        row = np.clip(descale(error * self.error_gain, FRACTION_BITS) + rows // 2, 0, rows - 1)
        column = np.clip(descale(current * self.current_gain, FRACTION_BITS), 0, columns - 1)
        layer = descale(change * self.velocity_gain, FRACTION_BITS) + layers // 2
        entry = self.values[row, column, np.clip(layer, 0, layers - 1)]
        output: Ints = entry.astype(np.int64) * self.output_gain
        return output


class Response(Protocol):
    """What a control law looks up: a table, or for comparison the inference that it came from."""

    def respond(self, error: Ints, current: Ints, change: Ints) -> Ints:
        """Output of every joint.

        Args:
            error: Coded angle errors, (J,) [counts].
            current: Coded absolute currents, (J,) [counts].
            change: Of the errors over one tick, (J,) [counts].

        Returns:
            (J,) fixed-point numbers.
        """


@dataclass(frozen=True, slots=True)
class JointPd:
    """What torque-controlled actuators do between control ticks, at their own rate.

    tau = stiffness (q_d - q) + damping (dq_d - dq) + feed_forward tau_ff, beside the torque that
    the rest of the control law commands.

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
    """A controller as it runs on the robot: integers only, errors and PWM in coded counts.

    Full scale of its output is the voltage of a DC motor's bridge, or the torque limit of a
    torque-controlled actuator.

    With change the error's over one tick, the direct part is the sum of error * proportional_gain,
    change * derivative_gain and what `direct` answers, >> 16; the integral part is the sum over
    ticks of error * integral_gain and what `integrated` answers, clamped to the PWM's range, >> 32.

    Attributes:
        proportional_gain: with 16 fraction bits.
        integral_gain: with 32 fraction bits.
        derivative_gain: with 16 fraction bits.
        direct: adds to the direct part.
        integrated: adds to the integral part.
        joint_pd: of torque-controlled actuators, in numbers of any precision; None for none.
    """

    proportional_gain: int = 0
    integral_gain: int = 0
    derivative_gain: int = 0
    direct: Response | None = None
    integrated: Response | None = None
    joint_pd: JointPd | None = None


@dataclass(frozen=True, slots=True)
class Universe:
    """An input or output of a fuzzy inference, of which the inference itself sees shares.

    Attributes:
        name: of the input or output.
        unit: of its values.
        full_range: share 1, in the unit.
        counts: coded counts of one unit, as a table takes or gives them.
    """

    name: str
    unit: str
    full_range: float
    counts: float = 1.0


@dataclass(frozen=True, slots=True, eq=False)
class Inference:
    """One output of a fuzzy controller: the inference, and the table that is shipped in its place.

    Attributes:
        output: its universe.
        inputs: their universes, in the system's order.
        system: the inference.
        axes: of the table, by input.
        table: what is shipped.
    """

    output: Universe
    inputs: Mapping[str, Universe]
    system: Mamdani
    axes: Mapping[str, Axis]
    table: LookupTable


def names_of(controller: Controller) -> frozenset[str]:
    """All that a design may give a controller."""
    return frozenset(v.name for v in (*controller.variables, *controller.conventions))


@runtime_checkable
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
        """Design variables with bounds and units, of which a design gives every one."""

    @property
    def conventions(self) -> tuple[Variable, ...]:
        """What the thesis leaves open, each with the default for designs that do not give it."""

    @property
    def published(self) -> Mapping[str, Mapping[str, float]]:
        """Designs from the literature, by the preference or study that they belong to.

        One that was tuned together with a gait has the gait's variables, too.
        """

    def compile(self, design: Mapping[str, float]) -> ControlLaw:
        """A design as it runs on the robot.

        Args:
            design: Value of every variable by name.

        Returns:
            Integers for the kernel.

        Raises:
            SimulationInputError: A value is missing or cannot be represented; names the variable.
        """

    def inferences(self, design: Mapping[str, float]) -> tuple[Inference, ...]:
        """The fuzzy inferences that a design's tables stand for.

        Args:
            design: Value of every variable by name.

        Returns:
            By output; none if the controller is not fuzzy.

        Raises:
            SimulationInputError: A value is missing or cannot be represented; names the variable.
        """
