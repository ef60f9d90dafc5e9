"""Robustness index of a design, estimated from a sample around it."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import closing
from typing import Final, TypedDict

import numpy as np
from pydantic import Field, ValidationError

from gaitswarm.errors import invalid_request, simulation_errors
from gaitswarm.requests.simulations import WalksRequest
from gaitswarm.services.optimizer.analysis.preferences import IndexView, PreferencesRequest
from gaitswarm.services.optimizer.analysis.robustness_index import (
    LocalSample,
    local_sample,
    robustness,
)
from gaitswarm.services.optimizer.errors import InvalidRequest
from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec
from gaitswarm.services.optimizer.run.evaluator import EvaluationRequest
from gaitswarm.sim.case import Walk
from gaitswarm.sim.catalogue import design_catalogue
from gaitswarm.sim.controllers import CONTROLLERS, ControllerName
from gaitswarm.sim.kernel.walk import Precision
from gaitswarm.sim.near_names import instead_of
from gaitswarm.sim.outcome import Outcome, Status
from gaitswarm.sim.provenance import provenance_of
from gaitswarm.sim.variables import Variable, VariableChoice
from gaitswarm.specs import RobotInput, ScenarioInput
from gaitswarm.views.robustness import RobustnessView

_BLOCK: Final = 64
"""Designs between two progress reports; a multiple of every kernel's lanes."""

Progress = Callable[[int, int], None]
"""Called with the number of simulations done and their total."""


class RobustnessOptions(TypedDict, total=False):
    """Fields of a `RobustnessRequest` as keywords.

    Attributes:
        scenarios: One scenario or several: names or numbers of presets, or `Scenario`; default the
            six of table 4.2.
        controller: Motor controller that drives the robot; default fuzzy-pi.
        robot: A shipped robot by name, a `RobotVariant`, or the folder of another.
        precision: Of the physics' numbers; default double.
        variables: Variables to vary, normalised by their bounds: names, or `Variable` with
            bounds of your own; default all of the controller's.
        samples: Designs to sample around the given one; default 256.
        radius: Largest distance from it, as a share of each variable's bounds; default
            0.02.
        seed: Of the sample; default 1.
    """

    scenarios: ScenarioInput | Iterable[ScenarioInput]
    controller: ControllerName
    robot: RobotInput
    precision: Precision
    variables: Sequence[str | Variable]
    samples: int
    radius: float
    seed: int


class RobustnessRequest(WalksRequest):
    """A design, its scenarios, and the sample around it."""

    variables: tuple[VariableChoice, ...] | None = Field(
        default=None,
        max_length=64,
        description="Variables to vary, normalised by their bounds: names, whose"
        " bounds are then those of /v1/controllers, or variables with bounds of your own. Null:"
        " all of the controller's.",
    )
    samples: int = Field(
        default=256, ge=8, le=4096, description="Designs to sample around the given one."
    )
    radius: float = Field(
        default=0.02,
        gt=0.0,
        le=0.5,
        description="Largest distance from it, as a share of each variable's bounds [1].",
    )
    seed: int = Field(default=1, ge=0, lt=2**63, description="Of the sample.")

    def sample(self) -> LocalSample:
        """The sampled designs."""
        try:
            return local_sample(
                self.numbers,
                tuple(self._resolved_variables()),
                radius=self.radius,
                samples=self.samples,
                seed=self.seed,
            )
        except ValueError as error:
            field, _, message = str(error).partition(": ")
            raise InvalidRequest(message, field=field) from error

    def _resolved_variables(self) -> Iterator[Variable]:
        catalogue = design_catalogue(self.controller)
        own = CONTROLLERS[self.controller].variables
        seen = set[str]()
        for index, entry in enumerate(own if self.variables is None else self.variables):
            name = entry if isinstance(entry, str) else entry.name
            if name in seen:
                raise ValueError(f"variables.{index}: {name!r} is named twice")
            seen.add(name)
            if name not in catalogue:
                raise ValueError(
                    f"variables.{index}: unknown variable {name!r}; {instead_of(name, catalogue)}"
                )
            if name not in self.design:
                raise ValueError(f"variables.{index}: the design gives no {name}")
            yield catalogue[name] if isinstance(entry, str) else entry


def run_robustness(
    request: RobustnessRequest, *, cpus: int | None = None, progress: Progress | None = None
) -> RobustnessView:
    """Simulate a design and a sample around it, and estimate its robustness."""
    request.check_walks()
    sample = request.sample()
    outcomes = _walked(request, sample, cpus, progress)
    objectives = np.stack([outcome.objectives for outcome in outcomes], axis=1)
    statuses = np.stack([outcome.statuses for outcome in outcomes], axis=1)
    return RobustnessView.from_robustness(
        robustness(sample, objectives, statuses != Status.OK),
        sample,
        robot=request.robot,
        controller=request.controller,
        precision=request.precision,
        seed=request.seed,
        scenarios=[scenario.name for scenario in request.resolved_scenarios()],
    )


def _walked(
    request: RobustnessRequest, sample: LocalSample, cpus: int | None, progress: Progress | None
) -> list[Outcome]:
    """Simulate the sample; one outcome per scenario."""
    from gaitswarm.services.runtime import open_evaluator

    cases = tuple(
        Walk(request.robot, request.controller, scenario, sample.names, request.precision)
        for scenario in request.resolved_scenarios()
    )
    provenance = provenance_of(request.robot, precision=request.precision)
    blocks: list[tuple[Outcome, ...]] = []
    n = len(sample.designs)
    with closing(open_evaluator("in-process", cpus=cpus)) as evaluator:
        for first in range(0, n, _BLOCK):
            designs = sample.designs[first : first + _BLOCK]
            asked = EvaluationRequest("", cases, designs, provenance)
            blocks.append(evaluator.evaluate(asked, lambda: False))
            if progress is not None:
                progress(min(first + _BLOCK, n) * len(cases), n * len(cases))
    return [
        Outcome(
            np.concatenate([part.objectives for part in parts]),
            np.concatenate([part.statuses for part in parts]),
        )
        for parts in zip(*blocks, strict=True)
    ]


def sampled_indices(
    spec: JobSpec,
    request: PreferencesRequest,
    designs: list[dict[str, float | str]],
    *,
    progress: Progress | None = None,
    check: Callable[[float], None] = lambda _seconds: None,
) -> list[IndexView | None]:
    """Simulate samples around designs of a job and estimate the robustness index of each.

    `check` is called with the simulated time of all of them [s].
    """
    if spec.case is not None:
        raise InvalidRequest(
            f"the job's designs were evaluated by {spec.case.name}, and samples would use"
            " gaitswarm's simulator; give 0",
            field="samples",
        )
    document = {
        "robot": spec.robot,
        "controller": spec.controller,
        "scenarios": spec.resolved_scenarios(),
        "variables": spec.design_space().variables,
        **request.model_dump(include={"samples", "radius", "seed", "precision"}),
    }
    try:
        requests = [
            RobustnessRequest.model_validate({**document, "design": design}) for design in designs
        ]
    except ValidationError as error:
        raise invalid_request(error) from error
    seconds = sum(one.simulated_seconds(one.resolved_scenarios()) for one in requests)
    check(seconds * (1 + request.samples))
    indices = []
    for number, one in enumerate(requests):

        def overall(done: int, planned: int, before: int = number) -> None:
            if progress is not None:
                progress(before * planned + done, len(requests) * planned)

        with simulation_errors("job_id"):
            indices.append(run_robustness(one, progress=overall).index)
    return indices
