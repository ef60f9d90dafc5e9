"""Walks as input and output of kernels, and the interface of a kernel."""

from __future__ import annotations

import math
import time
from collections.abc import Generator, Sequence
from dataclasses import dataclass, field
from itertools import islice
from typing import Any, Final, Literal, Protocol, TypeVar, overload

import numpy as np
from numpy.typing import NDArray

from gaitswarm.sim.controllers.base import ControlLaw, LookupTable
from gaitswarm.sim.errors import SimulationInputError
from gaitswarm.sim.kernel.sensors import NO_ERRORS, SensorErrors
from gaitswarm.sim.outcome import Status
from gaitswarm.sim.robot import Robot
from gaitswarm.sim.robot.actuators import CONTROL_RATE, LARGEST_OUTPUT
from gaitswarm.sim.robot.description import EnergyConvention

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

Precision = Literal["single", "double"]
"""Of the compiled physics. Positions, sums and control are computed in double precision in both."""

INTEGRANDS: Final = (
    "torque",
    "acceleration",
    "angular_acceleration",
    "power",
    "forward_speed",
    "absolute_power",
    "absolute_current",
    "heat",
)
"""Rates that a driver accumulates, at the middle of every step: squared gear torque sum [N2 m2],
squared accelerations [m2/s4], [rad2/s4], electrical power [W], speed along the heading [m/s]; over
the motors, the sums of the absolute electrical power [W], of the absolute current [A], and of the
heat R I^2 [W]."""

CODE_LIMIT = 65535
"""Largest coded error or current; the robot's integers have 16 bits."""

LARGEST_PWM = LARGEST_OUTPUT
"""Largest full scale of the PWM [counts]."""


@dataclass(frozen=True, slots=True)
class Coding:
    """Integers of sensors and PWM for a batch, and physics steps a control tick.

    Attributes:
        angle_counts: code of one radian [counts/rad].
        current_counts: code of one ampere [counts/A].
        duty_per_count: motor voltage per supply voltage, or torque per torque limit, of one count
            of a controller's output [1].
        angle_step: encoder resolution [counts].
        current_step: resolution of the current's converter [counts].
        pwm_step: resolution of the PWM [counts].
        pwm_counts: full scale of the PWM [counts].
        substeps: physics steps a control tick.
        refinement: how many times as many of a control tick in which a foot may come down: what
            happens then is faster than a step.
        inner_ticks: of the actuators' joint PD in a control tick, by which `substeps` is divided.
    """

    angle_counts: float
    current_counts: float
    duty_per_count: float
    angle_step: int
    current_step: int
    pwm_step: int
    pwm_counts: int
    substeps: int
    refinement: int = 1
    inner_ticks: int = 1

    def __post_init__(self) -> None:
        for name in (
            "angle_step",
            "current_step",
            "pwm_step",
            "pwm_counts",
            "substeps",
            "refinement",
            "inner_ticks",
        ):
            if getattr(self, name) < 1:
                raise SimulationInputError(f"{name}: {getattr(self, name)} is less than 1")
        if self.pwm_counts > LARGEST_PWM:
            raise SimulationInputError(f"pwm_counts: {self.pwm_counts} is over {LARGEST_PWM}")
        if self.substeps % self.inner_ticks:
            raise SimulationInputError(
                f"inner_ticks: {self.substeps} physics steps cannot be divided by them,"
                f" {self.inner_ticks}"
            )

    @classmethod
    def of(cls, robot: Robot, substeps: int, refinement: int = 1) -> Coding:
        """Resolutions of a robot's sensors and bridges."""
        d = robot.description
        counts, step, per_count = d.output
        return cls(
            angle_counts=d.sensors.angle_counts,
            current_counts=d.sensors.current_counts,
            duty_per_count=per_count,
            angle_step=d.sensors.angle_step,
            current_step=d.sensors.current_step,
            pwm_step=step,
            pwm_counts=counts,
            substeps=substeps,
            refinement=refinement,
            inner_ticks=d.inner_rate // CONTROL_RATE,
        )

    def angle_codes(self, angles: Floats) -> Ints:
        """What encoders say.

        Args:
            angles: Of the motors [rad].

        Returns:
            As many codes [counts].
        """
        return coarsen(
            _rounded(angles * self.angle_counts, -4 * CODE_LIMIT, 4 * CODE_LIMIT), self.angle_step
        )

    def current_codes(self, currents: Floats) -> Ints:
        """What the converters of the current sensors say.

        Args:
            currents: Absolute, behind the sensors' low-pass [A].

        Returns:
            As many codes [counts].
        """
        return coarsen(_rounded(currents * self.current_counts, 0, CODE_LIMIT), self.current_step)

    def pwm_codes(self, duty: Floats) -> Ints:
        """What the controller gave, of what the motors got.

        Args:
            duty: Motor voltage per supply voltage, or torque per torque limit [1].

        Returns:
            As many PWM counts [counts].
        """
        return np.rint(duty / self.duty_per_count).astype(np.int64)


def coarsen(code: Ints, step: int) -> Ints:
    """Nearest multiple of a resolution, halves up."""
    coarse: Ints = (code + step // 2) // step * step
    return coarse


def _rounded(value: Floats, low: int, high: int) -> Ints:
    """Of a NaN, 0."""
    whole = np.rint(value)
    whole[np.isnan(whole)] = 0.0
    return np.minimum(np.maximum(whole, low), high).astype(np.int64)


def current_smoothing(time_constant: float, timestep: float) -> float:
    """How fast the analog low-pass of the current follows.

    Args:
        time_constant: Of the low-pass [s]; 0 for none.
        timestep: Of the physics [s].

    Returns:
        Share of its distance from the absolute current that it goes in a physics step [1].
    """
    return -math.expm1(-timestep / time_constant) if time_constant > 0.0 else 1.0


@dataclass(frozen=True, slots=True, eq=False)
class WalkSetup:
    """One walk to be computed.

    Attributes:
        start: initial q, at rest, (7+J,).
        internal_state: initial, (I,), as `parameters.internal_state_size` says.
        parameters: (P,), as `parameters.Layout` says.
        desired: coded angles, (T, J) int32.
        control_law: of every joint.
        fall_height: of the body; below it the robot has fallen [m].
        fall_cosine: of the tilt; below it the robot has fallen.
        disturbance: torques on the links, (T, J) [N m], or, as the parameter `displaced` says,
            angles between gearheads and links [rad]; or None.
        energy: what of a motor's electrical power counts as spent.
        direction: of travel along the heading, 1 forward and -1 backward.
        drop: height of the start above the stance at which the soles carry the weight [m].
        current_smoothing: share of its distance from the absolute current that the analog
            low-pass of the current goes in a physics step; 1 for no low-pass [1].
        sensors: what they get wrong.
        shove_ticks: control ticks from which on, and up to which, the parameter `push` acts.
        feed_forward: torques with which the joints carry the robot, of which torque-controlled
            actuators are given the control law's share, (T, J) [N m]; or None.
    """

    start: Floats
    internal_state: Floats
    parameters: Floats
    desired: NDArray[np.int32]
    control_law: ControlLaw
    fall_height: float
    fall_cosine: float = 0.5**0.5
    disturbance: Floats | None = None
    energy: EnergyConvention = "signed"
    direction: int = 1
    drop: float = 0.0
    current_smoothing: float = 1.0
    sensors: SensorErrors = NO_ERRORS
    shove_ticks: tuple[int, int] = (0, 0)
    feed_forward: Floats | None = None

    def smoothing(self, refinement: int) -> float:
        """The analog low-pass over a shorter step.

        Returns:
            `current_smoothing` of such a step [1].
        """
        if refinement == 1 or self.current_smoothing >= 1.0:
            return self.current_smoothing
        return -math.expm1(math.log1p(-self.current_smoothing) / refinement)

    @property
    def ticks(self) -> int:
        """T, control ticks of the walk."""
        return len(self.desired)

    def check(self, *, joints: int, internal_state: int, parameters: int) -> None:
        """Refuse arrays that a kernel of these sizes would read beyond their ends."""
        ticks = max(self.ticks, 1)
        wanted: dict[str, tuple[NDArray[Any], tuple[int, ...]]] = {
            "start": (self.start, (7 + joints,)),
            "internal_state": (self.internal_state, (internal_state,)),
            "parameters": (self.parameters, (parameters,)),
            "desired": (self.desired, (ticks, joints)),
        }
        for name in ("disturbance", "feed_forward"):
            further = getattr(self, name)
            if further is not None:
                wanted[name] = (further, (ticks, joints))
        for name, (array, shape) in wanted.items():
            if array.shape != shape:
                raise SimulationInputError(
                    f"{name}: an array of shape {array.shape}; this kernel and walk need {shape}"
                )


@dataclass(frozen=True, slots=True, eq=False)
class WalkResult:
    """What became of a walk.

    Attributes:
        status: how it ended.
        sums: `INTEGRANDS` summed over physics steps, shorter ones by their share,
            (8,).
        end: final q, (7+J,).
        peak_current: largest |I| of any motor at any physics step [A].
        states: q, v, internal state, absolute current before the converters [A] and duty at every
            control tick after its control, (T, 7+J + 6+J + I + J + J), NaN after an early end;
            None if not asked for. `observation.walk_log` tells the rest.
    """

    status: Status
    sums: Floats
    end: Floats
    peak_current: float
    states: Floats | None = field(default=None, repr=False)


@dataclass(frozen=True, slots=True)
class LaneUse:
    """How well a kernel's lanes were used.

    Attributes:
        walked: rounds of physics steps, summed over lanes, that belonged to a walk.
        computed: rounds of physics steps, summed over lanes, in all.
        timed: what some of the rounds took, control ticks and all [ns].
        control: what the control ticks took of that [ns].
    """

    walked: int = 0
    computed: int = 0
    timed: int = field(default=0, compare=False)
    control: int = field(default=0, compare=False)

    @property
    def share(self) -> float:
        """Of the lanes' time that was walked [1]; 1 where nothing was computed."""
        return self.walked / self.computed if self.computed else 1.0

    @property
    def control_share(self) -> float:
        """Of the kernel's time that control ticks took [1]; 0 where nothing was timed."""
        return self.control / self.timed if self.timed else 0.0

    def __add__(self, other: LaneUse) -> LaneUse:
        return LaneUse(
            self.walked + other.walked,
            self.computed + other.computed,
            self.timed + other.timed,
            self.control + other.control,
        )

    def __sub__(self, other: LaneUse) -> LaneUse:
        return LaneUse(
            self.walked - other.walked,
            self.computed - other.computed,
            self.timed - other.timed,
            self.control - other.control,
        )


class WalkResults(Sequence[WalkResult]):
    """What became of all walks of one call, in their order.

    Args:
        waited: How long the thread waited for walks that others had taken over [s].
    """

    def __init__(
        self, results: tuple[WalkResult, ...], lane_use: LaneUse, waited: float = 0.0
    ) -> None:
        self._results = results
        self.lane_use = lane_use
        self.waited = waited

    def __len__(self) -> int:
        return len(self._results)

    @overload
    def __getitem__(self, index: int) -> WalkResult: ...
    @overload
    def __getitem__(self, index: slice) -> tuple[WalkResult, ...]: ...
    def __getitem__(self, index: int | slice) -> WalkResult | tuple[WalkResult, ...]:
        return self._results[index]


class Kernel(Protocol):
    """Computes walks. Thread-safe; a walk's result does not depend on its neighbours."""

    @property
    def backend(self) -> str:
        """`native` or `reference`."""

    @property
    def lanes(self) -> int:
        """Walks that are stepped together."""

    def walk(self, setups: Sequence[WalkSetup], coding: Coding, *, log: bool) -> WalkResults:
        """Compute walks.

        Args:
            setups: Any number of walks of the kernel's robot.
            coding: For all of them.
            log: Whether to keep states.

        Returns:
            Results, in order, and how the lanes were used.

        Raises:
            SimulationInputError: A setup has arrays of other sizes.
        """


NO_JOINT_PD: Final = (
    "a joint PD commands torques, and this robot has DC motors; choose another controller, or give"
    ' robot.toml actuators of kind = "torque"'
)
"""Why such a robot does not walk."""

_LARGEST_TERM = 2**51
"""Of a control law's sums; the compiled kernel adds up three of them, exactly, in 53 bits."""


def check_gains(law: ControlLaw, *, torque: bool) -> None:
    """Refuse gains with which the compiled kernel's arithmetic is not exact, or leaves a table."""
    if law.joint_pd is not None and not torque:
        raise SimulationInputError(NO_JOINT_PD)
    largest = {
        "proportional_gain": law.proportional_gain * CODE_LIMIT,
        "integral_gain": law.integral_gain * CODE_LIMIT,
        "derivative_gain": law.derivative_gain * 2 * CODE_LIMIT,
    }
    for part, table in (("direct", law.direct), ("integrated", law.integrated)):
        if isinstance(table, LookupTable):
            largest |= {
                f"{part}.output_gain": table.output_gain * 128,
                f"{part}.error_gain": table.error_gain * CODE_LIMIT,
                f"{part}.current_gain": table.current_gain * CODE_LIMIT,
                f"{part}.velocity_gain": table.velocity_gain * 2 * CODE_LIMIT,
            }
    for name, term in largest.items():
        if abs(term) > _LARGEST_TERM:
            raise SimulationInputError(f"{name}: too large for the controllers' integers")


T = TypeVar("T")


@dataclass(frozen=True, slots=True, eq=False)
class WantedWalk:
    """One walk, and what computes it.

    Attributes:
        kernel: of the robot that walks.
        coding: sensors, PWM and rates of the walk.
        setup: the walk.
        log: whether its states are to be kept.
    """

    kernel: Kernel
    coding: Coding
    setup: WalkSetup
    log: bool = False


Walking = Generator[Sequence[WantedWalk], Sequence[WalkResult], T]
"""What has walks computed on its way to a result: it yields the walks that it wants, is sent what
became of them, in their order, as often as it likes, and returns the result."""


@dataclass(slots=True)
class KernelTime:
    """What calls of kernels took, of those who ask for it.

    Attributes:
        seconds: wall time in the calls but for `waited`, added to [s].
        waited: time in the calls that went by until other threads had ended walks that they had
            taken over, added to [s].
        lane_use: of all of them.
    """

    seconds: float = 0.0
    waited: float = 0.0
    lane_use: LaneUse = field(default_factory=LaneUse)


def walk_together(
    walkings: Sequence[Walking[T]], kernel_time: KernelTime | None = None
) -> tuple[T, ...]:
    """Run several computations side by side; walks of one kernel and coding share one call.

    walkings                        calls
    a yields x1, x2; b yields y1    kernel.walk(x1, x2, y1)
    a returns; b yields y2          kernel.walk(y2)
    b returns                       -
    """
    results: dict[int, T] = {}
    answers: dict[int, Sequence[WalkResult] | None] = dict.fromkeys(range(len(walkings)))
    while answers:
        wanted: dict[int, Sequence[WantedWalk]] = {}
        for index, answer in answers.items():
            walking = walkings[index]
            try:
                wanted[index] = next(walking) if answer is None else walking.send(answer)
            except StopIteration as ended:
                results[index] = ended.value
        walks = [walk for own in wanted.values() for walk in own]
        computed = iter(_computed(walks, kernel_time or KernelTime()))
        answers = {index: list(islice(computed, len(own))) for index, own in wanted.items()}
    return tuple(results[index] for index in range(len(walkings)))


def _computed(walks: Sequence[WantedWalk], kernel_time: KernelTime) -> list[WalkResult]:
    """What became of the walks, in order."""
    calls: dict[tuple[Kernel, Coding, bool], list[int]] = {}
    for index, walk in enumerate(walks):
        calls.setdefault((walk.kernel, walk.coding, walk.log), []).append(index)
    found: dict[int, WalkResult] = {}
    for (kernel, coding, log), indices in calls.items():
        setups = [walks[index].setup for index in indices]
        begun = time.perf_counter()
        results = kernel.walk(setups, coding, log=log)
        kernel_time.seconds += time.perf_counter() - begun - results.waited
        kernel_time.waited += results.waited
        kernel_time.lane_use += results.lane_use
        found.update(zip(indices, results, strict=True))
    return [found[index] for index in range(len(walks))]
