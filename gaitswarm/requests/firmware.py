"""Firmware of a design."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, TypedDict

from pydantic import Field, ValidationError

from gaitswarm.designs import ScenariosRequest
from gaitswarm.errors import invalid_request, simulation_errors
from gaitswarm.services.optimizer.errors import InvalidRequest, NotFound
from gaitswarm.services.optimizer.jobs.documents import AnySpec
from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec
from gaitswarm.sim.catalogue import design_numbers
from gaitswarm.sim.controllers import ControllerName
from gaitswarm.sim.firmware import Firmware, check_drives_by_pwm, check_table_bits, firmware_of
from gaitswarm.specs import RobotInput, ScenarioInput
from gaitswarm.views.firmware import FirmwareView
from gaitswarm.views.history import BestView


class FirmwareOptions(TypedDict, total=False):
    """Fields of a `FirmwareRequest` as keywords.

    Attributes:
        scenarios: One scenario or several, whose trajectories are written and whose walks are
            repeated: names or numbers of presets, or `Scenario`; default those of the job, of other
            designs the six of table 4.2.
        controller: Motor controller that drives the robot; default that of the job, or fuzzy-pi.
        robot: A shipped robot by name, a `RobotVariant`, or the folder of another; default that of
            the job, or the default robot.
        label: Display name of the design.
        table_bits: Of the indices of angle error and current in a fuzzy controller's table, in
            place of 10 and 6, where there is less flash.
    """

    scenarios: ScenarioInput | Iterable[ScenarioInput]
    controller: ControllerName
    robot: RobotInput
    label: str
    table_bits: tuple[int, int] | None


class FirmwareRequest(ScenariosRequest):
    """A design and the scenarios whose trajectories and simulations its firmware includes."""

    label: str = Field(default="design", max_length=200, description="Display name of the design.")
    table_bits: tuple[int, int] | None = Field(
        default=None,
        description="Of the indices of angle error and current in a fuzzy controller's table, in"
        " place of 10 and 6; simulations use this table.",
        examples=[[8, 6]],
    )

    @property
    def walked_seconds(self) -> float:
        """Length of all simulations [s]; with another table each is compared with the default's."""
        seconds = self.simulated_seconds(self.resolved_scenarios())
        return seconds if self.table_bits is None else 2.0 * seconds

    def check(self) -> None:
        """Check the design, its gaits and its table before anything is simulated."""
        with simulation_errors("robot"):
            check_drives_by_pwm(self.robot)
        self.check_design()
        self.check_gaits()
        if self.table_bits is not None:
            with simulation_errors("table_bits"):
                check_table_bits(self.controller, self.table_bits)


def firmware_request_of_best(
    job_id: str, spec: AnySpec, best: BestView | None, options: dict[str, Any]
) -> FirmwareRequest:
    """Request firmware of a job's best design, by default for its robot and scenarios."""
    if not isinstance(spec, JobSpec):
        raise InvalidRequest(
            f"job {job_id} is of kind {spec.kind}, which tunes no drive", field="job_id"
        )
    if options.get("controller", spec.controller) != spec.controller:
        raise InvalidRequest(
            f"job {job_id} tunes {spec.controller}; leave it out", field="controller"
        )
    if best is None:
        raise NotFound(f"job {job_id} has no design yet that walks in every scenario")
    document = {
        "robot": spec.robot,
        "controller": spec.controller,
        "design": design_numbers(spec.controller, best.design),
        "scenarios": spec.resolved_scenarios(),
        "label": spec.name or f"job {job_id}",
        **options,
    }
    try:
        return FirmwareRequest.model_validate(document)
    except ValidationError as error:
        raise invalid_request(error) from error


def run_firmware(request: FirmwareRequest) -> Firmware:
    """Write a design as C code, with simulations to test it."""
    request.check()
    with simulation_errors("scenarios"):
        return firmware_of(
            request.robot,
            request.controller,
            request.numbers,
            request.resolved_scenarios(),
            label=request.label,
            table_bits=request.table_bits,
        )


def firmware_view(
    request: FirmwareRequest, firmware: Firmware, folder: str | None = None
) -> FirmwareView:
    """Describe firmware."""
    return FirmwareView.from_firmware(
        firmware,
        folder=folder,
        label=request.label,
        controller=request.controller,
        design=request.numbers,
    )
