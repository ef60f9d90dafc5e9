"""`gaitswarm robustness`: sensitivity of objectives to small changes of a design."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any

import typer

from gaitswarm.cli.inputs.options import ControllerOption, Place, Precision, RobotOption
from gaitswarm.cli.output import note
from gaitswarm.cli.tables import SHORT, Bold, interval, number, table

if TYPE_CHECKING:
    from gaitswarm.cli.inputs.design_file import GivenDesign
    from gaitswarm.cli.output import Printed
    from gaitswarm.cli.rich_table import Table
    from gaitswarm.robustness_index import Progress, RobustnessRequest, RobustnessView

Samples = Annotated[int, typer.Option(help="Designs to sample around each given one.")]
Radius = Annotated[
    float, typer.Option(help="Radius of the sample, as a share of each variable's bounds.")
]
Seed = Annotated[int, typer.Option(help="Seed of the sample.")]


@dataclass(frozen=True, slots=True)
class SampleOptions:
    """Options of a sample around designs."""

    samples: Samples = 256
    radius: Radius = 0.02
    seed: Seed = 1
    scenarios: Annotated[
        str | None,
        typer.Option(
            help="Names, numbers or FILE.json, separated by commas, or all.",
            show_default="those of the job, else all of the robot",
        ),
    ] = None
    controller: ControllerOption = None
    robot: RobotOption = None
    precision: Precision = None

    def request(self, given: GivenDesign) -> RobustnessRequest:
        """Return the request for a design; a job's best uses the job's scenarios and robot."""
        from pydantic import ValidationError

        from gaitswarm.cli.inputs.robots import robot_defaults, scenario_data
        from gaitswarm.errors import invalid_request
        from gaitswarm.robustness_index import RobustnessRequest

        scenarios: Any = scenario_data(self.scenarios or "all", self.robot)
        if given.spec is None:
            controlled = robot_defaults(self.robot).of_controller(given.controller)
            variables = controlled.get("variables")
        else:
            variables = given.spec.design_space().variables
            if self.scenarios is None:
                scenarios = given.spec.resolved_scenarios()
        data: dict[str, Any] = {
            "controller": given.controller,
            "design": given.values,
            "samples": self.samples,
            "radius": self.radius,
            "seed": self.seed,
            "precision": self.precision or "double",
            "scenarios": scenarios,
            "robot": given.robot(self.robot),
            "variables": variables,
        }
        try:
            return RobustnessRequest.model_validate(data)
        except ValidationError as error:
            raise invalid_request(error) from error


def robustness(
    design: Annotated[
        str,
        typer.Argument(
            metavar="DESIGN|ID",
            help="Design file, `-`, or published:NAME, as for `simulate`; or a job's id for its"
            " best.",
        ),
    ],
    options: SampleOptions,
    *,
    place: Place,
) -> Printed:
    """Estimate the robustness index of a design (thesis 4.4.3); smaller is more robust.

    It is the norm of the Jacobian of the objectives' logarithms with respect to the variables as
    shares of their bounds, from a regression over designs sampled around the given one.
    """
    from gaitswarm.cli.inputs.design_file import given_design

    given = given_design(design, options.controller, robot=options.robot, place=place)
    view = estimate(options.request(given))
    return view, _parts(view)


def _parts(view: RobustnessView) -> Iterator[Table | str]:
    def cells(name: str, part: Any, failed: int) -> list[Any]:
        shares = [number(value, 3) for value in part.by_objective.values()]
        return [name, *interval(part.index), *shares, failed]

    rows = [cells(name, part, part.failed) for name, part in view.scenarios.items()]
    rows.append(Bold(cells("all", view, sum(part.failed for part in view.scenarios.values()))))
    heads = ["scenario", "index", "95 %", *(SHORT[o.name] for o in view.objectives), "failed"]
    yield table(heads, rows, title="Robustness index", gap=1)
    parts: list[Any] = [view, *view.scenarios.values()]
    by_variable = (
        (
            variable.name,
            f"{number(variable.least)} – {number(variable.most)}",
            *(number(part.by_variable[variable.name], 3) for part in parts),
        )
        for variable in sorted(
            view.variables, key=lambda v: view.by_variable[v.name] or 0.0, reverse=True
        )
    )
    heads = ["sampled", "all", *(name.replace("-", "-\n") for name in view.scenarios)]
    yield table(["variable", *heads], by_variable, title="By variable", gap=1)
    yield (
        f"{view.samples} designs within {100.0 * view.radius:g} % of each variable's bounds;"
        " values are relative changes of objectives over the whole bounds; smaller is more robust"
    )
    largest = {
        o.name: max(part.unexplained[o.name] or 0.0 for part in view.scenarios.values())
        for o in view.objectives
    }
    shares = (f"{SHORT[name]} {number(100.0 * value, 2)} %" for name, value in largest.items())
    yield f"unexplained by the linear model, largest of all scenarios: {', '.join(shares)}"
    if view.held:
        yield f"fixed: {', '.join(view.held)}"


def estimate(request: RobustnessRequest) -> RobustnessView:
    """Estimate the index, with progress on stderr."""
    from gaitswarm.robustness_index import run_robustness

    with shown_progress() as progress:
        return run_robustness(request, progress=progress)


@contextmanager
def shown_progress() -> Iterator[Progress]:
    """Print progress to stderr every two seconds."""
    last = time.monotonic()

    def progress(done: int, planned: int) -> None:
        nonlocal last
        if done < planned and time.monotonic() - last >= 2.0:
            last = time.monotonic()
            note(f"{done} of {planned} simulations")

    yield progress
