"""Single precision: twice the lanes, its own bits, results close to double precision."""

from __future__ import annotations

import ctypes
import dataclasses
from collections.abc import Sequence

import numpy as np
import pytest

from gaitswarm.sim.arrays import Floats
from gaitswarm.sim.assembly import control_steps, judge, plan_walk
from gaitswarm.sim.compiler.compilation import Target, load_library, target, vector_header
from gaitswarm.sim.controllers import CONTROLLERS
from gaitswarm.sim.controllers.base import ControlLaw
from gaitswarm.sim.controllers.fixed_point import CONTROL_PERIOD
from gaitswarm.sim.kernel import Precision
from gaitswarm.sim.kernel.native import NativeKernel, load_kernel, native_kernel
from gaitswarm.sim.kernel.walk import WalkSetup
from gaitswarm.sim.outcome import Status
from gaitswarm.sim.robot import RobotVariant, load_robot
from gaitswarm.sim.robot.robot import Robot
from gaitswarm.sim.scenario import SCENARIOS

TOLERANCE = 1e-4
"""Of objectives, as a share of themselves, of a walk that is not sensitive itself."""

FLOAT = 1e-7
"""What the last bit of a float is of its value, about."""

PUBLISHED: list[ControlLaw] = [
    controller.compile(design)
    for controller in CONTROLLERS.values()
    for design in controller.published.values()
]


def kernel_in(precision: Precision, robot: Robot) -> NativeKernel:
    kernel = native_kernel(robot, precision)
    assert kernel is not None
    return kernel


def short_walks(robot: Robot) -> list[WalkSetup]:
    """One step of every scenario, and the published designs in the first of them."""
    _, timestep = control_steps(robot)
    plans = [
        plan_walk(robot, scenario.model_copy(update={"cycles": 1.0}), timestep)
        for scenario in SCENARIOS
    ]
    setups = [plan(PUBLISHED[0]) for plan in plans if plan is not None]
    assert len(setups) == len(SCENARIOS)
    assert plans[0] is not None
    return setups + [plans[0](law) for law in PUBLISHED[1:]]


def test_a_kernel_of_floats_has_twice_the_lanes(robot: Robot) -> None:
    single, double = kernel_in("single", robot), kernel_in("double", robot)
    assert (single.precision, double.precision) == ("single", "double")
    assert single.lanes == 2 * double.lanes
    assert kernel_in("single", robot) is single
    assert native_kernel(robot) is double


def objectives(kernel: NativeKernel, robot: Robot, setups: Sequence[WalkSetup]) -> Floats:
    """f1 to f5; the last, a difference of heights, may be next to nothing."""
    coding, timestep = control_steps(robot)
    results = kernel.walk(setups, coding, log=False)
    judged = [
        judge(setup, result, coding.substeps, timestep)
        for setup, result in zip(setups, results, strict=True)
    ]
    assert {status for status, _ in judged} == {Status.OK}
    return np.array([values[:5] for _, values in judged])


def from_another_start(setup: WalkSetup, rng: np.random.Generator) -> WalkSetup:
    start = setup.start.copy()
    start[7:] *= 1.0 + FLOAT * rng.normal(size=len(start) - 7)
    return dataclasses.replace(setup, start=start)


@pytest.mark.slow
@pytest.mark.variants("szabadka2-reconstructed")
@pytest.mark.parametrize(
    "choice", ["szabadka2", "szabadka2-reconstructed", RobotVariant(contact_law="stick")], ids=str
)
def test_objectives_are_those_of_double_precision_unless_the_last_bit_of_a_float_alters_them(
    choice: str | RobotVariant,
) -> None:
    robot = load_robot(choice)
    double, rng = kernel_in("double", robot), np.random.default_rng(2)
    setups = short_walks(robot)
    expected = objectives(double, robot, setups)
    others = [
        objectives(double, robot, [from_another_start(setup, rng) for setup in setups])
        for _ in range(6)
    ]
    sensitivity = np.abs(np.array(others) / expected - 1.0).max(axis=(0, 2))
    single = objectives(kernel_in("single", robot), robot, setups)
    deviation = np.abs(single / expected - 1.0).max(axis=1)
    assert np.all(deviation < TOLERANCE + 2.0 * sensitivity)
    assert np.median(sensitivity) < 10.0 * TOLERANCE


@pytest.mark.variants("Target(lanes=4,*")
@pytest.mark.slow
@pytest.mark.parametrize("narrower", [Target(4, "x86-64-v3"), Target(2, "")], ids=str)
def test_floats_have_the_same_bits_at_every_vector_width(narrower: Target, robot: Robot) -> None:
    if target().lanes < narrower.lanes:
        narrower = target()
    narrow = load_kernel(robot, "single", compile_for=narrower)
    assert narrow is not None
    assert narrow.lanes == 2 * narrower.lanes
    setups, (coding, _) = short_walks(robot), control_steps(robot)
    assert coding.refinement > 1
    ours = kernel_in("single", robot).walk(setups, coding, log=True)
    theirs = narrow.walk(setups, coding, log=True)
    for a, b in zip(ours, theirs, strict=True):
        assert a.status is b.status is Status.OK
        np.testing.assert_array_equal(a.sums, b.sums)
        np.testing.assert_array_equal(a.end, b.end)
        np.testing.assert_array_equal(a.states, b.states)


def test_small_increments_of_large_positions_are_kept(robot: Robot) -> None:
    """A robot that all but floats for 0.2 s; a float of its height changes by nothing."""
    kernel = kernel_in("single", robot)
    (setup, *_) = short_walks(robot)
    parameters = setup.parameters.copy()
    for name in ("gravity", "stiffness", "damping"):
        parameters[kernel.layout.slices[name]] = 0.0
    parameters[kernel.layout.slices["gravity"]] = [0.0, 0.0, 1e-6]
    start = setup.start.copy()
    start[2] = 10.0
    floating = dataclasses.replace(
        setup,
        start=start,
        parameters=parameters,
        desired=np.repeat(setup.desired[:1], 100, axis=0),
        control_law=ControlLaw(),
    )
    (result,) = kernel.walk([floating], control_steps(robot)[0], log=False)
    risen = 0.5 * 1e-6 * (100 * CONTROL_PERIOD) ** 2
    assert result.end[2] - 10.0 == pytest.approx(risen, rel=1e-3)
    assert risen < np.spacing(np.float32(10.0))


def test_sine_and_cosine_of_floats_are_accurate_to_their_last_bits() -> None:
    source = (
        f"#define SINGLE\n{vector_header()}"
        "void both(const float *x, float *s, float *c, int64_t n)\n"
        "{ for (int64_t k = 0; k < n; k++) { vec a, b; vec_sincos(SPLAT(x[k]), &a, &b);\n"
        "  s[k] = a[0]; c[k] = b[0]; } }"
    )
    library = load_library("sincos-single-check", source.encode(), lambda: source)
    assert library is not None
    x = np.linspace(-20, 20, 20001, dtype=np.float32)
    sine, cosine = np.empty_like(x), np.empty_like(x)
    pointers = [ctypes.c_void_p(a.ctypes.data) for a in (x, sine, cosine)]
    library.both(*pointers, ctypes.c_int64(len(x)))
    assert np.abs(sine - np.sin(x.astype(np.float64))).max() < 1.2e-7
    assert np.abs(cosine - np.cos(x.astype(np.float64))).max() < 1.2e-7


@pytest.mark.parametrize("wanted", [target(), Target(4, "x86-64-v3"), Target(2, "")], ids=str)
@pytest.mark.parametrize("precision", ["double", "single"])
def test_fused_multiply_add_is_rounded_once_whatever_the_machine_has(
    precision: Precision, wanted: Target
) -> None:
    kind, define = ("float", "#define SINGLE\n") if precision == "single" else ("double", "")
    source = (
        f"{define}{vector_header()}"
        f"void fused(const {kind} *a, const {kind} *b, const {kind} *c, {kind} *out) {{\n"
        "  const vec x = SPLAT(*a), y = SPLAT(*b), z = SPLAT(*c);\n"
        "  out[0] = vec_fma(x, y, z)[0], out[1] = vec_fms(x, y, z)[0];\n"
        "  out[2] = vec_fnma(x, y, z)[LANES - 1]; }"
    )
    aim = wanted if wanted.lanes <= target().lanes else target()
    library = load_library("fused-check", source.encode(), lambda: source, compile_for=aim)
    assert library is not None
    real = np.float32 if precision == "single" else np.float64
    epsilon = float(np.finfo(real).eps)
    # (1 + e)(1 - e) = 1 - e^2, of which a rounded product keeps nothing.
    x, y, z = (np.array([value], dtype=real) for value in (1.0 + epsilon, 1.0 - epsilon, 1.0))
    out = np.empty(3, dtype=real)
    library.fused(*(ctypes.c_void_p(a.ctypes.data) for a in (x, y, np.negative(z), out)))
    assert out.tolist() == [-(epsilon**2), 2.0, -2.0]
    library.fused(*(ctypes.c_void_p(a.ctypes.data) for a in (x, y, z, out)))
    assert out.tolist() == [2.0, -(epsilon**2), epsilon**2]
