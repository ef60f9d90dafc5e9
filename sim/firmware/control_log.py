"""What a walk's controllers read and gave, in codes: what firmware is compared with."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gaitswarm.sim.assembly import control_steps, judge, kernel_of, plan_walk
from gaitswarm.sim.controllers import ControlLaw
from gaitswarm.sim.firmware.integers import in_16_bits
from gaitswarm.sim.gait.trajectory import require_reachable
from gaitswarm.sim.gait_variables import with_gait
from gaitswarm.sim.kernel.observation import encoder_angles, split_states
from gaitswarm.sim.kernel.walk import Coding, WalkResult, WalkSetup
from gaitswarm.sim.outcome import Status
from gaitswarm.sim.robot import Robot
from gaitswarm.sim.scenario import Scenario

Codes = NDArray[np.int16]


@dataclass(frozen=True, slots=True, eq=False)
class ControlLog:
    """Every sample of a walk's controllers; T ticks, J joints.

    Attributes:
        scenario: that was walked, in the gait of the design.
        status: how the walk ended.
        desired: (T, J) [counts of angle].
        angle: of the motors, (T, J) [counts of angle].
        current: absolute, (T, J) [counts of current].
        pwm: that the controllers gave, (T, J) [PWM counts].
        objectives: what the walk is worth, f1 to f6, (6,), NaN where there is none.
    """

    scenario: Scenario
    status: Status
    desired: Codes
    angle: Codes
    current: NDArray[np.uint16]
    pwm: Codes
    objectives: NDArray[np.float64]

    @property
    def ticks(self) -> int:
        """T."""
        return len(self.pwm)


def control_logs(
    robot: Robot,
    scenarios: Sequence[Scenario],
    law: ControlLaw,
    gait: Mapping[str, float],
) -> tuple[ControlLog, ...]:
    """Let a control law walk, and keep what it read and gave."""
    kernel = kernel_of(robot)
    coding, timestep = control_steps(robot)
    walked = [with_gait(scenario, gait) for scenario in scenarios]
    setups = []
    for scenario in walked:
        require_reachable(robot, scenario)
        plan = plan_walk(robot, scenario, timestep)
        if plan is None:
            raise AssertionError("a gait within reach is planned")
        setups.append(plan(law))
    results = kernel.walk(setups, coding, log=True)
    return tuple(
        _control_log(robot, scenario, coding, timestep, setup, result)
        for scenario, setup, result in zip(walked, setups, results, strict=True)
    )


def _control_log(
    robot: Robot,
    scenario: Scenario,
    coding: Coding,
    timestep: float,
    setup: WalkSetup,
    result: WalkResult,
) -> ControlLog:
    if result.states is None:
        raise AssertionError("states are kept of a walk whose log is asked for")
    walked = int(np.isfinite(result.states).all(axis=1).sum())
    states = split_states(robot, result.states[:walked])
    desired = setup.desired[:walked].astype(np.int64)
    angle = coding.angle_codes(encoder_angles(robot, states))
    current = coding.current_codes(states.sensed_current)
    joints = robot.joint_names
    status, objectives = judge(setup, result, coding.substeps, timestep)
    return ControlLog(
        scenario=scenario,
        status=status,
        desired=in_16_bits(desired, np.int16, f"{scenario.name}: the desired angle", joints),
        angle=in_16_bits(angle, np.int16, f"{scenario.name}: the angle", joints),
        current=in_16_bits(current, np.uint16, f"{scenario.name}: the current", joints),
        pwm=coding.pwm_codes(states.duty).astype(np.int16),
        objectives=objectives,
    )
