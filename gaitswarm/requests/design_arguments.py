"""Arguments about single designs, converted to checked requests.

Functions raise InvalidRequest that names the argument, before anything is simulated.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from gaitswarm.errors import InvalidRequest
from gaitswarm.requests.arguments import checked
from gaitswarm.requests.firmware import (
    FirmwareOptions,
    FirmwareRequest,
    firmware_request_of_best,
)
from gaitswarm.requests.robustness import RobustnessOptions, RobustnessRequest
from gaitswarm.requests.simulations import ReplayRequest, SimulationRequest
from gaitswarm.requests.surface import SurfaceRequest
from gaitswarm.services.optimizer.jobs.documents import AnySpec
from gaitswarm.sim.controllers import ControllerName
from gaitswarm.sim.kernel.walk import Precision
from gaitswarm.specs import (
    PreferenceInput,
    RobotInput,
    ScenarioInput,
    robot_source,
    scenario_entries,
)
from gaitswarm.views import BestView


def simulation(
    design: Mapping[str, float | str],
    *,
    scenarios: ScenarioInput | Iterable[ScenarioInput] | None,
    controller: ControllerName,
    robot: RobotInput,
    preference: PreferenceInput,
    precision: Precision,
    world: Mapping[str, float] | None,
    log: bool,
) -> SimulationRequest:
    """A design and the scenarios in which to simulate it."""
    document: dict[str, Any] = {
        "robot": robot_source(robot),
        "controller": controller,
        "design": _design(design),
        "preference": preference,
        "precision": precision,
        "world": _world(world),
        "log": log,
    }
    if scenarios is not None:
        document["scenarios"] = scenario_entries(scenarios)
    return checked(SimulationRequest, document)


def robustness(design: Mapping[str, float | str], options: RobustnessOptions) -> RobustnessRequest:
    """A design, its scenarios, and the sample around it."""
    return checked(RobustnessRequest, {**_laid(options), "design": _design(design)})


def firmware(design: Mapping[str, float | str], options: FirmwareOptions) -> FirmwareRequest:
    """A design and the scenarios of its firmware."""
    return checked(FirmwareRequest, {**_laid(options), "design": _design(design)})


def firmware_of_best(
    job_id: str, spec: AnySpec, best: BestView, options: FirmwareOptions
) -> FirmwareRequest:
    """A job's best design and the scenarios of its firmware."""
    return firmware_request_of_best(job_id, spec, best, _laid(options))


def replay(
    design: Mapping[str, float | str],
    *,
    scenario: ScenarioInput,
    controller: ControllerName,
    robot: RobotInput,
    world: Mapping[str, float] | None,
    rate: float,
) -> ReplayRequest:
    """A design and the scenario to replay."""
    document: dict[str, Any] = {
        "robot": robot_source(robot),
        "controller": controller,
        "design": _design(design),
        "scenario": scenario,
        "world": _world(world),
        "rate": rate,
    }
    return checked(ReplayRequest, document)


def surface(
    design: Mapping[str, float | str],
    *,
    error_points: int,
    current_points: int,
    velocity_error: float,
) -> SurfaceRequest:
    """A design of a fuzzy controller and the grid of its surfaces."""
    document: dict[str, Any] = {
        "design": _design(design),
        "error_points": error_points,
        "current_points": current_points,
        "velocity_error": velocity_error,
    }
    return checked(SurfaceRequest, document)


def _design(design: Mapping[str, float | str]) -> dict[str, float | str]:
    if not isinstance(design, Mapping):
        raise InvalidRequest("must be a mapping of values by name", field="design")
    return dict(design)


def _world(world: Mapping[str, float] | None) -> dict[str, float]:
    if world is not None and not isinstance(world, Mapping):
        raise InvalidRequest("must be a mapping of values by name", field="world")
    return dict(world or {})


def _laid(options: RobustnessOptions | FirmwareOptions) -> dict[str, Any]:
    document: dict[str, Any] = dict(options)
    if "robot" in options:
        document["robot"] = robot_source(options["robot"])
    if "scenarios" in options:
        document["scenarios"] = scenario_entries(options["scenarios"])
    return document
