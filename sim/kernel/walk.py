"""Inputs and results of simulated walks, and the interface of the kernels that compute them."""

from __future__ import annotations

import math
import operator
import time
from collections.abc import Generator, Iterable, Sequence
from dataclasses import astuple, dataclass, field
from itertools import islice
from typing import Final, Protocol, Self, TypeVar

import numpy as np
from numpy.typing import NDArray

from gaitswarm.sim.arrays import Floats, Ints
from gaitswarm.sim.controllers.base import ControlLaw, LookupTable
from gaitswarm.sim.errors import SimulationInputError
from gaitswarm.sim.kernel.parameters import Layout, internal_state_size
from gaitswarm.sim.kernel.sensors import NO_ERRORS, SensorErrors
from gaitswarm.sim.outcome import Status
from gaitswarm.sim.robot.description import CONTROL_RATE, LARGEST_OUTPUT, EnergyConvention
from gaitswarm.sim.robot.robot import Robot
from gaitswarm.sim.terrain import HeightGrid

T = TypeVar("T")

INTEGRANDS: Final = (
    "torque",
    "acceleration",
    "angular_acceleration",
    "power",
    "forward_speed",
    "absolute_power",
    "absolute_current",
    "heat",
    "slip",
)
"""Rates that a driver sums up at the middle of every step: squared gear torque sum [N2 m2], squared
accelerations [m2/s4], [rad2/s4], electrical power [W], speed along the heading [m/s]; over the
motors, the sums of the absolute electrical power [W], of the absolute current [A], and of the heat
R I^2 [W]; over the feet on the ground, the sum of the speeds along it [m/s]."""

PEAKS: Final = ("current", "torque", "roll_tangent", "pitch_sine")
"""Of which a driver keeps the largest absolute value at the middle of any step: motors' currents
[A], torques that gears pass to links [N m], and the body's attitude against the ground [1]."""

CODE_LIMIT = 65535
"""Largest coded error or current; the robot's integers have 16 bits."""

LARGEST_PWM = LARGEST_OUTPUT
"""Largest full scale of the PWM [counts]."""


@dataclass(frozen=True, slots=True)
class Coding:
    """Resolutions of sensors and PWM, and physics steps per control tick."""

    angle_counts: float  # [counts/rad]
    current_counts: float  # [counts/A]
    # motor voltage per supply voltage [1], or torque per torque limit, per count of the output
    duty_per_count: float
    angle_step: int  # encoder resolution [counts]
    current_step: int  # resolution of the current's converter [counts]
    pwm_step: int  # resolution of the PWM [counts]
    pwm_counts: int  # full scale of the PWM [counts]
    substeps: int  # physics steps per control tick
    # factor by which steps are shorter in control ticks in which a foot may touch down
    refinement: int = 1
    inner_ticks: int = 1  # ticks of the actuators' joint PD per control tick; divides `substeps`

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
                raise SimulationInputError(f"{name}: {getattr(self, name)} must be at least 1")
        if self.pwm_counts > LARGEST_PWM:
            raise SimulationInputError(
                f"pwm_counts: {self.pwm_counts} must be at most {LARGEST_PWM}"
            )
        if self.substeps % self.inner_ticks:
            raise SimulationInputError(
                f"inner_ticks: {self.inner_ticks} does not divide {self.substeps} physics steps"
            )

    @classmethod
    def of(cls, robot: Robot, substeps: int, refinement: int = 1) -> Coding:
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
        """Encode motor angles [rad] as [counts]."""
        return coarsen(
            _rounded(angles * self.angle_counts, -4 * CODE_LIMIT, 4 * CODE_LIMIT), self.angle_step
        )

    def current_codes(self, currents: Floats) -> Ints:
        """Encode absolute currents [A], behind the sensors' low-pass, as [counts]."""
        return coarsen(_rounded(currents * self.current_counts, 0, CODE_LIMIT), self.current_step)

    def pwm_codes(self, duty: Floats) -> Ints:
        """Convert motor voltages per supply voltage, or torques per torque limit, to [counts]."""
        return np.rint(duty / self.duty_per_count).astype(np.int64)


def coarsen(code: Ints, step: int) -> Ints:
    """Round to the nearest multiple of a resolution, halves up."""
    coarse: Ints = (code + step // 2) // step * step
    return coarse


def _rounded(value: Floats, low: int, high: int) -> Ints:
    """Round and clip; a NaN becomes 0."""
    whole = np.rint(value)
    whole[np.isnan(whole)] = 0.0
    return np.minimum(np.maximum(whole, low), high).astype(np.int64)


def current_smoothing(time_constant: float, timestep: float) -> float:
    """Share of its distance to the absolute current that the low-pass covers in a step [1]."""
    return -math.expm1(-timestep / time_constant) if time_constant > 0.0 else 1.0


@dataclass(frozen=True, slots=True, eq=False)
class WalkSetup:
    """Input of one walk."""

    start: Floats  # initial q, at rest, (7+J,)
    internal_state: Floats  # initial, (I,), see `parameters.internal_state_size`
    parameters: Floats  # (P,), see `parameters.Layout`
    desired: NDArray[np.int32]  # coded angles, (T, J) int32
    control_law: ControlLaw  # of every joint
    fall_height: float  # height of the body below which the robot has fallen [m]
    cycle: int  # whole control ticks in a cycle of the gait
    fall_cosine: float = 0.5**0.5  # cosine of the tilt below which the robot has fallen
    # torques on the links, (T, J) [N m], or, with the parameter `displaced`, angles between
    # gearheads and links [rad]; or None
    disturbance: Floats | None = None
    energy: EnergyConvention = "signed"  # which part of a motor's electrical power counts as spent
    direction: int = 1  # of travel along the heading, 1 forward and -1 backward
    # height of the start above the stance at which the soles carry the weight [m]
    drop: float = 0.0
    current_smoothing: float = 1.0  # see the function of this name; 1 for no low-pass [1]
    sensors: SensorErrors = NO_ERRORS
    # first control tick of the shove by the parameter `push`, and the tick after its last
    shove_ticks: tuple[int, int] = (0, 0)
    # torques with which the joints carry the robot, of which torque-controlled actuators receive
    # the control law's share, (T, J) [N m]; or None
    feed_forward: Floats | None = None
    # uneven ground, and the corners of the body's underside in its frame (4, 3) [m]
    terrain: HeightGrid | None = None
    corners: Floats = field(default_factory=lambda: np.zeros((4, 3)))

    def smoothing(self, refinement: int) -> float:
        """Return `current_smoothing` for steps that are shorter by a factor [1]."""
        if refinement == 1 or self.current_smoothing >= 1.0:
            return self.current_smoothing
        return -math.expm1(math.log1p(-self.current_smoothing) / refinement)

    @property
    def ticks(self) -> int:
        """T, control ticks of the walk."""
        return len(self.desired)


@dataclass(frozen=True, slots=True, eq=False)
class WalkResult:
    """Result of one walk."""

    status: Status
    sums: Floats  # `INTEGRANDS` summed over physics steps, shorter steps by their share, (9,)
    end: Floats  # final q, (7+J,)
    peaks: Floats  # `PEAKS` of the whole walk, (4,)
    # least over legs and whole cycles of the height to which a sole was lifted above the ground in
    # the cycle [m]; infinite before the end of the first cycle
    clearance: float
    # q, v, internal state, absolute current before the converters [A] and duty at every control
    # tick after its control, (T, 7+J + 6+J + I + J + J), NaN after an early end; None without a
    # log. See `observation.walk_log`.
    states: Floats | None = field(default=None, repr=False)


@dataclass(frozen=True, slots=True)
class LaneUse:
    """Utilization of a kernel's lanes."""

    walked: int = 0  # rounds of physics steps that belonged to a walk, summed over lanes
    computed: int = 0  # all rounds of physics steps, summed over lanes
    # time of a sample of the rounds, control ticks included [ns]
    timed: int = field(default=0, compare=False)
    control: int = field(default=0, compare=False)  # time of the control ticks in that sample [ns]

    @property
    def share(self) -> float:
        """Share of the lanes' time spent on walks [1]; 1 if nothing was computed."""
        return self.walked / self.computed if self.computed else 1.0

    @property
    def control_share(self) -> float:
        """Share of the kernel's time spent in control ticks [1]; 0 if nothing was timed."""
        return self.control / self.timed if self.timed else 0.0

    def __add__(self, other: LaneUse) -> LaneUse:
        return LaneUse(*map(operator.add, astuple(self), astuple(other)))

    def __sub__(self, other: LaneUse) -> LaneUse:
        return LaneUse(*map(operator.sub, astuple(self), astuple(other)))


class WalkResults(tuple[WalkResult, ...]):  # noqa: SLOT001 - with attributes
    """Results of all walks of one call, in order."""

    lane_use: LaneUse
    waited: float  # time that the thread waited for walks taken over by other threads [s]

    def __new__(cls, results: Iterable[WalkResult], lane_use: LaneUse, waited: float = 0.0) -> Self:
        walks = super().__new__(cls, results)
        walks.lane_use, walks.waited = lane_use, waited
        return walks


class Kernel(Protocol):
    """Computes walks. Thread-safe; a walk's result does not depend on the other walks of a call."""

    @property
    def backend(self) -> str:
        """`native` or `reference`."""

    @property
    def lanes(self) -> int:
        """Number of walks that are stepped together."""

    def walk(self, setups: Sequence[WalkSetup], coding: Coding, *, log: bool) -> WalkResults:
        """Compute walks.

        Args:
            setups: Any number of walks of the kernel's robot.
            coding: For all of them.
            log: Whether to keep states.

        Returns:
            Results in order, and the use of the lanes.

        Raises:
            SimulationInputError: A setup has arrays of other sizes.
        """


NO_JOINT_PD: Final = (
    "a joint PD commands torques, and this robot has DC motors; choose another controller, or give"
    ' robot.toml actuators of kind = "torque"'
)

NO_SERVO: Final = (
    "the controller servo commands angles to servos, and this robot has none; choose another"
    " controller, or give the actuators of robot.toml a table servo"
)

_LARGEST_TERM = 2**51
"""Of a control law's sums; the compiled kernel adds three of them exactly in 53 bits."""


def check_gains(law: ControlLaw, *, torque: bool, servo: bool = False) -> None:
    """Check that the law suits the actuators and is computed exactly by the compiled kernel."""
    if law.joint_pd is not None and not torque:
        raise SimulationInputError(NO_JOINT_PD)
    if law.servo is not None and not servo:
        raise SimulationInputError(NO_SERVO)
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


def check_setups(robot: Robot, setups: Sequence[WalkSetup]) -> None:
    """Check the control laws, and the shapes of arrays that a robot's kernel reads."""
    for law in {id(setup.control_law): setup.control_law for setup in setups}.values():
        check_gains(law, torque=robot.is_torque_controlled, servo=robot.servos is not None)
    n = robot.n_joints
    for setup in setups:
        by_tick = max(setup.ticks, 1), n
        shapes: dict[str, tuple[int, ...]] = {
            "start": (7 + n,),
            "internal_state": (internal_state_size(robot),),
            "parameters": (Layout.of(robot).size,),
            "desired": by_tick,
            "disturbance": by_tick,
            "feed_forward": by_tick,
        }
        for name, shape in shapes.items():
            array = getattr(setup, name)
            if array is not None and array.shape != shape:
                raise SimulationInputError(
                    f"{name}: array of shape {array.shape}; this kernel and walk require {shape}"
                )


@dataclass(frozen=True, slots=True, eq=False)
class WalkRequest:
    """One walk and the kernel that computes it."""

    kernel: Kernel
    coding: Coding
    setup: WalkSetup
    log: bool = False  # whether to keep its states


Walking = Generator[Sequence[WalkRequest], Sequence[WalkResult], T]
"""A computation that needs walks: a generator that yields requests, receives their results in
order, and returns its own result. It may yield any number of times."""


@dataclass(slots=True)
class KernelTime:
    """Accumulated time of kernel calls."""

    seconds: float = 0.0  # wall time in the calls, without `waited` [s]
    # time in the calls spent waiting for walks that other threads had taken over [s]
    waited: float = 0.0
    lane_use: LaneUse = field(default_factory=LaneUse)


def walk_together(
    walkings: Sequence[Walking[T]], kernel_time: KernelTime | None = None
) -> tuple[T, ...]:
    """Run several computations concurrently; walks that they yield for one kernel share a call."""
    results: dict[int, T] = {}
    answers: dict[int, Sequence[WalkResult] | None] = dict.fromkeys(range(len(walkings)))
    while answers:
        requests: dict[int, Sequence[WalkRequest]] = {}
        for index, answer in answers.items():
            walking = walkings[index]
            try:
                requests[index] = next(walking) if answer is None else walking.send(answer)
            except StopIteration as ended:
                results[index] = ended.value
        walks = [walk for batch in requests.values() for walk in batch]
        computed = iter(_computed(walks, kernel_time or KernelTime()))
        answers = {index: list(islice(computed, len(batch))) for index, batch in requests.items()}
    return tuple(results[index] for index in range(len(walkings)))


def _computed(walks: Sequence[WalkRequest], kernel_time: KernelTime) -> list[WalkResult]:
    """Compute the walks with one call per kernel, coding and log; return the results in order."""
    calls: dict[tuple[Kernel, Coding, bool], list[int]] = {}
    for index, walk in enumerate(walks):
        calls.setdefault((walk.kernel, walk.coding, walk.log), []).append(index)
    result_of: dict[int, WalkResult] = {}
    for (kernel, coding, log), indices in calls.items():
        setups = [walks[index].setup for index in indices]
        begun = time.perf_counter()
        results = kernel.walk(setups, coding, log=log)
        kernel_time.seconds += time.perf_counter() - begun - results.waited
        kernel_time.waited += results.waited
        kernel_time.lane_use += results.lane_use
        result_of.update(zip(indices, results, strict=True))
    return [result_of[index] for index in range(len(walks))]
