"""Sensors with noise and delay in the kernels."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, Final

import numpy as np
import pytest
from numpy.typing import NDArray

from gaitswarm.sim.assembly import control_steps, plan_walk
from gaitswarm.sim.controllers import control_law
from gaitswarm.sim.errors import SimulationInputError
from gaitswarm.sim.kernel import LARGEST_DELAY, Precision
from gaitswarm.sim.kernel.native import NativeKernel, native_kernel
from gaitswarm.sim.kernel.reference import reference_kernel
from gaitswarm.sim.kernel.sensors import SensorErrors, Sensors, philox
from gaitswarm.sim.kernel.walk import Coding, WalkResult, WalkSetup
from gaitswarm.sim.robot import RobotVariant, load_robot
from gaitswarm.sim.robot.robot import Robot
from tests.examples.walks import PUBLISHED_A, short_walk

Floats = NDArray[np.float64]

STIFF: Final = control_law("p", (("P", 1.0),))
"""PWM counts are the angle's error in counts, up to full scale."""

GUARDED: Final = control_law("fuzzy-pi", tuple(PUBLISHED_A.items()))
"""A drive that looks at the current, too."""

BAD: Final = SensorErrors(
    angle_noise=2e-3, current_noise=0.1, angle_delay=2, current_delay=5, seed=2**40 + 17
)


def words(text: str) -> list[int]:
    return [int(word, 16) for word in text.split()]


@pytest.mark.parametrize(
    ("counter", "key", "answer"),
    [
        (
            "00000000 00000000 00000000 00000000",
            "00000000 00000000",
            "6627e8d5 e169c58d bc57ac4c 9b00dbd8",
        ),
        (
            "ffffffff ffffffff ffffffff ffffffff",
            "ffffffff ffffffff",
            "408f276d 41c83b0e a20bc7c6 6d5451fd",
        ),
        (
            "243f6a88 85a308d3 13198a2e 03707344",
            "a4093822 299f31d0",
            "d16cfe09 94fdcceb 5001e420 24126ea1",
        ),
    ],
)
def test_philox_reproduces_published_values(counter: str, key: str, answer: str) -> None:
    """Those of Random123, the authors' library."""
    first, second = np.array(words(key), dtype=np.uint64)
    found = philox(np.array(words(counter), dtype=np.uint64), (first, second))
    assert found.tolist() == words(answer)


def readings(errors: SensorErrors, ticks: int, joints: int = 18) -> tuple[Floats, Floats]:
    """Of angles that are the number of the tick, and of no current."""
    sensors = Sensors(errors)
    readings = [sensors.read(np.full(joints, float(t)), np.zeros(joints)) for t in range(ticks)]
    angles, currents = zip(*readings, strict=True)
    return np.array(angles), np.array(currents)


def test_noise_is_white_and_nearly_normal() -> None:
    ticks = 1500
    angles, currents = readings(SensorErrors(angle_noise=0.3, current_noise=2.0, seed=5), ticks)
    both = np.concatenate(
        [(angles - np.arange(float(ticks))[:, np.newaxis]) / 0.3, currents / 2.0], axis=1
    )
    error = 4.5 / np.sqrt(ticks)
    assert np.abs(both.mean(axis=0)).max() < error
    assert np.abs(both.std(axis=0) - 1.0).max() < error
    # Joints and sensors, neighbouring ticks.
    assert np.abs(np.corrcoef(both.T) - np.eye(36)).max() < error
    assert np.abs((both[1:] * both[:-1]).mean(axis=0)).max() < error
    beyond = [float((np.abs(both) > limit).mean()) for limit in (1.0, 2.0)]
    np.testing.assert_allclose(beyond, [0.317, 0.0455], rtol=0.07)
    assert 3.5 < np.abs(both).max() < 4.9


def test_noise_is_another_one_with_another_seed() -> None:
    noises = [readings(SensorErrors(current_noise=1.0, seed=s), 3)[1] for s in (1, 2, 1 + 2**32)]
    assert not np.equal(noises[0], noises[1]).any()
    assert not np.equal(noises[0], noises[2]).any()


@pytest.mark.parametrize("delay", [0, 1, LARGEST_DELAY])
def test_a_delay_shifts_readings_and_begins_with_the_first_one(delay: int) -> None:
    angles, currents = readings(SensorErrors(angle_delay=delay), 40)
    np.testing.assert_array_equal(angles[:, 0], np.maximum(np.arange(40.0) - delay, 0.0))
    noise = SensorErrors(current_noise=1.0, seed=3)
    prompt = readings(noise, 40)[1]
    late = readings(replace(noise, current_delay=delay), 40)[1]
    np.testing.assert_array_equal(late[delay:], prompt[: 40 - delay])
    assert not currents.any()


def setup_of(robot: Robot, errors: SensorErrors, law: Any = STIFF, **scenario: Any) -> WalkSetup:
    _, timestep = control_steps(robot)
    plan = plan_walk(robot, short_walk(**scenario), timestep)
    assert plan is not None
    return replace(plan(law), sensors=errors)


def kernel_and_coding(robot: Robot, precision: Precision = "double") -> tuple[NativeKernel, Coding]:
    kernel = native_kernel(robot, precision)
    assert kernel is not None
    return kernel, control_steps(robot)[0]


def test_a_drive_follows_its_encoders_readings(robot: Robot) -> None:
    errors = SensorErrors(angle_noise=1e-3, angle_delay=3, seed=11)
    kernel, coding = kernel_and_coding(robot)
    setup = setup_of(robot, errors)
    (result,) = kernel.walk([setup], coding, log=True)
    assert result.states is not None
    sensors, n = Sensors(errors), robot.n_joints
    angles, duty = result.states[:, 7 : 7 + n], result.states[:, -n:]
    readings = np.array([sensors.read(row, np.zeros(n))[0] for row in angles])
    counts = setup.desired - np.rint(readings * coding.angle_counts)
    expected = np.clip(counts, -coding.pwm_counts, coding.pwm_counts) * coding.duty_per_count
    np.testing.assert_array_equal(duty, expected)
    assert np.abs(np.diff(readings - angles, axis=0)).max() > 1e-3


@pytest.mark.variants
@pytest.mark.parametrize(
    "variant",
    [RobotVariant(name="szabadka2"), RobotVariant(), RobotVariant(backlash=(2.5, 1.0, 1.0))],
    ids=["plain", "filtered", "backlash"],
)
def test_kernels_agree_on_imperfect_sensors(variant: RobotVariant) -> None:
    robot = load_robot(variant)
    native, coding = kernel_and_coding(robot)
    setup = setup_of(robot, BAD, GUARDED, cycle_time=0.3)
    (fast,), (slow,) = (
        kernel.walk([setup], coding, log=True) for kernel in (native, reference_kernel(robot))
    )
    assert fast.states is not None and slow.states is not None
    # The duty is made of whole numbers, which are the same.
    np.testing.assert_array_equal(fast.states[:, -18:], slow.states[:, -18:])
    np.testing.assert_allclose(fast.sums, slow.sums, rtol=1e-7)
    (exact,) = native.walk([replace(setup, sensors=SensorErrors())], coding, log=False)
    assert not np.allclose(fast.sums, exact.sums, rtol=1e-3)


def bits(result: WalkResult) -> bytes:
    return result.sums.tobytes() + result.end.tobytes()


@pytest.mark.variants
@pytest.mark.parametrize("precision", ["double", "single"])
def test_imperfect_sensors_have_the_same_bits_in_any_lane_and_do_not_affect_neighbours(
    robot: Robot, precision: Precision
) -> None:
    kernel, coding = kernel_and_coding(robot, precision)
    good = setup_of(robot, SensorErrors(), GUARDED, cycle_time=0.5, drop=0.003)
    kinds = [
        SensorErrors(),
        BAD,
        SensorErrors(angle_noise=1e-3, seed=4),
        SensorErrors(current_delay=15, angle_delay=1),
    ]
    setups = [replace(good, sensors=kinds[k % 4]) for k in range(2 * kernel.lanes + 3)]
    company = kernel.walk(setups, coding, log=False)
    alone = [bits(kernel.walk([replace(good, sensors=e)], coding, log=False)[0]) for e in kinds]
    assert [bits(result) for result in company] == [alone[k % 4] for k in range(len(setups))]
    assert len(set(alone)) == 4


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("angle_noise", -1.0),
        ("current_noise", float("nan")),
        ("angle_delay", LARGEST_DELAY + 1),
        ("current_delay", -1),
        ("seed", -1),
    ],
)
def test_impossible_sensor_errors_are_refused_by_name(name: str, value: Any) -> None:
    with pytest.raises(SimulationInputError, match=f"^{name}: "):
        SensorErrors(**{name: value})
