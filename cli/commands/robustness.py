"""`gaitswarm robustness`: sensitivity of objectives to small changes of a design."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Annotated, Any

import typer

from gaitswarm.cli.inputs.options import ControllerOption, Db, Json, Precision, RobotOption, Server

if TYPE_CHECKING:
    from gaitswarm.cli.inputs.design_file import GivenDesign
    from gaitswarm.requests.robustness import Progress, RobustnessRequest
    from gaitswarm.views.robustness import RobustnessView

Samples = Annotated[int, typer.Option(help="Designs to sample around each given one.")]
Radius = Annotated[
    float, typer.Option(help="Radius of the sample, as a share of each variable's bounds.")
]
Seed = Annotated[int, typer.Option(help="Seed of the sample.")]
Scenarios = Annotated[
    str | None,
    typer.Option(
        help="Names, numbers or FILE.json, separated by commas, or all.",
        show_default="those of the job, else all of the robot",
    ),
]


def register(app: typer.Typer) -> None:
    """Add the commands."""
    app.command()(robustness)


def robustness(
    design: Annotated[
        str,
        typer.Argument(
            metavar="DESIGN|ID",
            help="Design file, `-`, or published:NAME, as for `simulate`; or a job's id for its"
            " best.",
        ),
    ],
    samples: Samples = 256,
    radius: Radius = 0.02,
    seed: Seed = 1,
    scenarios: Scenarios = None,
    controller: ControllerOption = None,
    robot: RobotOption = None,
    precision: Precision = None,
    server: Server = None,
    db: Db = None,
    as_json: Json = False,
) -> None:
    """Estimate the robustness index of a design (thesis 4.4.3); smaller is more robust.

    It is the norm of the Jacobian of the objectives' logarithms with respect to the variables as
    shares of their bounds, from a regression over designs sampled around the given one.
    """
    from gaitswarm.cli.inputs.design_file import given_design
    from gaitswarm.cli.output import print_json

    given = given_design(design, controller, robot=robot, server=server, db=db)
    request = robustness_request(
        given,
        samples=samples,
        radius=radius,
        seed=seed,
        scenarios=scenarios,
        robot=robot,
        precision=precision,
    )
    view = estimate(request)
    if as_json:
        print_json(view)
    else:
        _print(view)


def robustness_request(
    given: GivenDesign,
    *,
    samples: int,
    radius: float,
    seed: int,
    scenarios: str | None,
    robot: str | None,
    precision: str | None,
) -> RobustnessRequest:
    """Build the request for a design; a job's best uses the job's scenarios and robot."""
    from pydantic import ValidationError

    from gaitswarm.cli.inputs.robots import robot_defaults, scenario_data
    from gaitswarm.errors import invalid_request
    from gaitswarm.requests.robustness import RobustnessRequest

    data: dict[str, Any] = {
        "controller": given.controller,
        "design": given.values,
        "samples": samples,
        "radius": radius,
        "seed": seed,
        "precision": precision or "double",
        "scenarios": scenario_data(scenarios or "all", robot),
        "robot": given.robot(robot),
    }
    if given.spec is None:
        data["variables"] = robot_defaults(robot).of_controller(given.controller).get("variables")
    else:
        data["variables"] = given.spec.design_space().variables
        if scenarios is None:
            data["scenarios"] = given.spec.resolved_scenarios()
    try:
        return RobustnessRequest.model_validate(data)
    except ValidationError as error:
        raise invalid_request(error) from error


def estimate(request: RobustnessRequest) -> RobustnessView:
    """Estimate the index, with progress on stderr."""
    from gaitswarm.requests.robustness import run_robustness

    with shown_progress() as progress:
        return run_robustness(request, progress=progress)


@contextmanager
def shown_progress() -> Iterator[Progress]:
    """Print progress to stderr every two seconds."""
    import time

    from gaitswarm.cli.output import note

    last = time.monotonic()

    def progress(done: int, planned: int) -> None:
        nonlocal last
        if done < planned and time.monotonic() - last >= 2.0:
            last = time.monotonic()
            note(f"{done} of {planned} simulations")

    yield progress


def _print(view: RobustnessView) -> None:
    from gaitswarm.cli.output import stdout_console
    from gaitswarm.cli.robustness import scenarios_table, summary, variables_table

    console = stdout_console()
    console.print(scenarios_table(view))
    console.print(variables_table(view))
    for line in summary(view):
        console.print(line, markup=False)
