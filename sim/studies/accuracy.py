"""What the model's simplifications cost: tables for inference, steps for time, noise on links."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import ValidationError

from gaitswarm.sim.assembly import PHYSICS_RATE, control_steps, judge, plan_walk
from gaitswarm.sim.controllers.base import ControlLaw
from gaitswarm.sim.controllers.fuzzy_pi import FuzzyPi
from gaitswarm.sim.controllers.quantisation import Axis
from gaitswarm.sim.errors import SimulationInputError
from gaitswarm.sim.input import message_of
from gaitswarm.sim.kernel.reference import reference_kernel
from gaitswarm.sim.noise import LinkNoise
from gaitswarm.sim.outcome import Status
from gaitswarm.sim.robot import DEFAULT_ROBOT, RobotChoice, load_robot
from gaitswarm.sim.robot.robot import with_shafts
from gaitswarm.sim.scenario import SCENARIOS, Scenario
from gaitswarm.sim.simulate import simulate

RESOLUTIONS: Final = ((6, 6), (8, 8), (10, 6))
"""Bits of error and current in the tables that are compared."""

NoiseKind = Literal["angle", "torque"]

RATES: Final = (2_500, 5_000, 10_000, 20_000)

NOISE: Final[Mapping[NoiseKind, float]] = MappingProxyType({"angle": 0.001, "torque": 10.0})
"""Standard deviations [rad], [N m] of the study's noise; the thesis does not give its own."""

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Deviation:
    """Objectives of one variant of a walk against its reference, (6,) each, NaN where undefined.

    Attributes:
        variant: what differs.
        scenario: name of the walk.
        reference: objectives of the reference.
        ratio: variant over reference [1].
    """

    variant: str
    scenario: str
    reference: Floats
    ratio: Floats

    @property
    def quality(self) -> float:
        """Ratio of f = speed / (f1 f2 f3 f4), the sixth row of table 2.9 [1]."""
        return float(1.0 / np.prod(self.ratio[:5]))

    @property
    def relative(self) -> Floats:
        """Distance of the ratio from one, (6,)."""
        return np.abs(self.ratio - 1.0)


def tables_against_inference(
    design: Mapping[str, float],
    scenarios: Sequence[Scenario] = SCENARIOS,
    *,
    robot: RobotChoice = DEFAULT_ROBOT,
) -> tuple[Deviation, ...]:
    """A Fuzzy-PI's tables of several resolutions against 64-bit inference (section 5.3).

    All walk in the reference kernel, so that nothing but the table differs.
    """
    controller = FuzzyPi()
    deviations = []
    for scenario in scenarios:
        exact = _reference_walk(scenario, controller.without_table(design), robot)
        for error, current in RESOLUTIONS:
            control_law = controller.compile_with(design, Axis(error, True), Axis(current, False))
            deviations.append(
                Deviation(
                    f"{error}x{current} bit",
                    scenario.name,
                    exact,
                    _reference_walk(scenario, control_law, robot) / exact,
                )
            )
    return tuple(deviations)


def step_halving(
    controller: str,
    design: Mapping[str, float],
    scenarios: Sequence[Scenario] = SCENARIOS,
    *,
    robot: RobotChoice = DEFAULT_ROBOT,
) -> tuple[Deviation, ...]:
    """Physics at 2.5, 5, 10 and 20 kHz against 40 kHz."""
    deviations = []
    for scenario in scenarios:
        finest = _walk(scenario, controller, design, robot, physics_rate=2 * RATES[-1])
        for rate in RATES:
            walked = _walk(scenario, controller, design, robot, physics_rate=rate)
            deviations.append(
                Deviation(f"{rate / 1000:g} kHz", scenario.name, finest, walked / finest)
            )
    return tuple(deviations)


def noise_on_links(
    controller: str,
    design: Mapping[str, float],
    scenarios: Sequence[Scenario] = SCENARIOS[:1],
    *,
    robot: RobotChoice = DEFAULT_ROBOT,
    kind: NoiseKind = "angle",
    deviation: float | None = None,
) -> tuple[Deviation, ...]:
    """Noise on link 1, 2 or 3 relative to the noiseless run of the same robot (table 2.9).

    Args:
        deviation: Standard deviation of the noise [rad], [N m]; that of `NOISE` if left out.
    """
    machine = with_shafts(load_robot(robot)) if kind == "angle" else load_robot(robot)
    size = NOISE[kind] if deviation is None else deviation
    try:
        noises = [
            LinkNoise.model_validate({"link": link, "kind": kind, "deviation": size, "seed": 1})
            for link in (1, 2, 3)
        ]
    except ValidationError as error:
        said = message_of(error.errors(include_url=False)[0])
        raise SimulationInputError(
            said if said.startswith("deviation: ") else f"deviation: {said}"
        ) from error
    deviations = []
    for scenario in scenarios:
        calm = _walk(scenario, controller, design, machine)
        for noise in noises:
            noisy = _walk(scenario, controller, design, machine, noise=noise)
            deviations.append(Deviation(f"link {noise.link}", scenario.name, calm, noisy / calm))
    return tuple(deviations)


def _walk(
    scenario: Scenario,
    controller: str,
    design: Mapping[str, float],
    robot: RobotChoice,
    *,
    physics_rate: int = PHYSICS_RATE,
    noise: LinkNoise | None = None,
) -> Floats:
    values = np.array([list(design.values())])
    outcome = simulate(
        scenario,
        controller,
        list(design),
        values,
        robot=robot,
        physics_rate=physics_rate,
        noise=noise,
    ).outcome
    objectives: Floats = outcome.objectives[0]
    return objectives


def _reference_walk(scenario: Scenario, control_law: ControlLaw, robot: RobotChoice) -> Floats:
    machine = load_robot(robot)
    kernel = reference_kernel(machine)
    coding, timestep = control_steps(machine)
    plan = plan_walk(machine, scenario, timestep)
    if plan is None:
        raise SimulationInputError(f"scenario {scenario.name!r}: out of the legs' reach")
    setup = plan(control_law)
    (result,) = kernel.walk([setup], coding, log=False)
    status, objectives = judge(setup, result, coding.substeps, timestep)
    return objectives if status is Status.OK else np.full_like(objectives, np.nan)
