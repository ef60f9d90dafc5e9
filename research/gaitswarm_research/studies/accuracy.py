"""Cost of the model's simplifications: tables for inference, time steps, noise on links."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any, Final, Literal

import numpy as np
import typer
from numpy.typing import NDArray
from pydantic import ValidationError
from rich.console import Console
from rich.table import Table

from gaitswarm import OBJECTIVES, InvalidRequest, Scenario, Status, job_spec
from gaitswarm.plugins import (
    ControlLaw,
    FuzzyPi,
    LinkNoise,
    Robot,
    TableAxis,
    load_robot,
    simulate_walk,
    with_shafts,
)
from gaitswarm_research import options

RESOLUTIONS: Final = ((6, 6), (8, 8), (10, 6))
"""Bits of error and current in the tables that are compared."""

RATES: Final = (2_500, 5_000, 10_000, 20_000)
"""Physics steps per second [Hz] that are compared with twice the last."""

NoiseKind = Literal["angle", "torque"]

NOISE: Final[Mapping[NoiseKind, float]] = {"angle": 0.001, "torque": 10.0}
"""Default standard deviations [rad], [N m]; the thesis does not state its own."""

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Deviation:
    """Objectives f1 to f6 of a variant against its reference, NaN where undefined.

    Attributes:
        ratio: (6,) variant over reference [1].
    """

    variant: str
    scenario: str
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
    design: Mapping[str, float], scenarios: Sequence[Scenario], robot: Robot
) -> list[Deviation]:
    """Compare a Fuzzy-PI's tables of several resolutions with 64-bit inference (section 5.3).

    All run in the reference kernel, so that nothing but the table differs.
    """
    controller = FuzzyPi()
    deviations = []
    for scenario in scenarios:
        exact = _by_law(scenario, controller.without_table(design), robot)
        for error, current in RESOLUTIONS:
            axes = TableAxis(error, True), TableAxis(current, False)
            tabulated = _by_law(scenario, controller.compile_with(design, *axes), robot)
            variant = f"{error}x{current} bit"
            deviations.append(Deviation(variant, scenario.name, tabulated / exact))
    return deviations


def step_halving(
    controller: str, design: Mapping[str, float], scenarios: Sequence[Scenario], robot: Robot
) -> list[Deviation]:
    """Compare physics at `RATES` with twice the greatest of them."""
    values = np.array([list(design.values())])

    def simulated(scenario: Scenario, rate: int) -> Floats:
        simulation = simulate_walk(
            scenario, controller, list(design), values, robot=robot, physics_rate=rate
        )
        objectives: Floats = simulation.outcome.objectives[0]
        return objectives

    return [
        Deviation(f"{rate / 1000:g} kHz", scenario.name, simulated(scenario, rate) / finest)
        for scenario in scenarios
        for finest in [simulated(scenario, 2 * RATES[-1])]
        for rate in RATES
    ]


def noise_on_links(
    controller: str,
    design: Mapping[str, float],
    scenarios: Sequence[Scenario],
    robot: Robot,
    *,
    kind: NoiseKind = "angle",
    deviation: float | None = None,
    seed: int = 1,
) -> list[Deviation]:
    """Compare noise on link 1, 2 or 3 with the noiseless run of the same robot (table 2.9)."""
    size = NOISE[kind] if deviation is None else deviation
    try:
        noises = [
            LinkNoise.model_validate({"link": link, "kind": kind, "deviation": size, "seed": seed})
            for link in (1, 2, 3)
        ]
    except ValidationError as error:
        reason = error.errors(include_url=False)[0]["msg"].removeprefix("Value error, ")
        raise InvalidRequest(reason.removeprefix("deviation: "), field="deviation") from error
    if kind == "angle":
        # Noise on an angle displaces the link against its gearhead, which needs elastic shafts.
        robot = with_shafts(robot)
    values = np.array([list(design.values())])

    def simulated(scenario: Scenario, noise: LinkNoise | None) -> Floats:
        simulation = simulate_walk(
            scenario, controller, list(design), values, robot=robot, noise=noise
        )
        objectives: Floats = simulation.outcome.objectives[0]
        return objectives

    return [
        Deviation(f"link {noise.link}", scenario.name, simulated(scenario, noise) / noiseless)
        for scenario in scenarios
        for noiseless in [simulated(scenario, None)]
        for noise in noises
    ]


def _by_law(scenario: Scenario, law: ControlLaw, robot: Robot) -> Floats:
    """(6,) objectives of a control law in the reference kernel."""
    designs = np.empty((1, 0))
    outcome = simulate_walk(scenario, law, (), designs, robot=robot, backend="reference").outcome
    if outcome.statuses[0] != Status.OK:
        return np.full(len(OBJECTIVES), np.nan)
    objectives: Floats = outcome.objectives[0]
    return objectives


ScenarioOption = Annotated[
    str, typer.Option(help="Names or numbers of scenarios separated by commas, or all.")
]
Controller = Annotated[str, typer.Option(help="Motor controller of the design.")]


def tables(
    design: options.Design = "published:A",
    scenario: ScenarioOption = "all",
    robot: options.Robot = None,
    as_json: options.Json = False,
) -> None:
    """Compare a Fuzzy-PI's tables of 6 x 6, 8 x 8 and 10 x 6 bits with full inference."""
    values = options.read_design(design, "fuzzy-pi")
    _show(tables_against_inference(values, *_setting("fuzzy-pi", scenario, robot)), as_json=as_json)


def steps(
    design: options.Design = "published:A",
    controller: Controller = "fuzzy-pi",
    scenario: ScenarioOption = "all",
    robot: options.Robot = None,
    as_json: options.Json = False,
) -> None:
    """Compare physics at 2.5, 5, 10 and 20 kHz with 40 kHz."""
    values = options.read_design(design, controller)
    _show(step_halving(controller, values, *_setting(controller, scenario, robot)), as_json=as_json)


def noise(
    design: options.Design = "published:A",
    controller: Controller = "fuzzy-pi",
    scenario: ScenarioOption = "1",
    kind: Annotated[
        NoiseKind, typer.Option(help="On the angle between gearhead and link, or on its torque.")
    ] = "angle",
    deviation: Annotated[
        float | None,
        typer.Option(help="Standard deviation. Default: 0.001 rad, or 10 N m of torque."),
    ] = None,
    robot: options.Robot = None,
    as_json: options.Json = False,
) -> None:
    """Put noise on each kind of link in turn; ratios to the noiseless simulation (table 2.9)."""
    values = options.read_design(design, controller)
    setting = _setting(controller, scenario, robot)
    found = noise_on_links(controller, values, *setting, kind=kind, deviation=deviation)
    _show(found, as_json=as_json, ratios=True)


def _setting(
    controller: str, scenarios: str, robot: str | None
) -> tuple[tuple[Scenario, ...], Robot]:
    """Scenarios and robot of a command's options."""
    fields: dict[str, Any] = {"controller": controller}
    if robot is not None:
        fields["robot"] = robot
    if scenarios != "all":
        fields["scenarios"] = [entry.strip() for entry in scenarios.split(",")]
    spec = job_spec(**fields)
    return spec.resolved_scenarios(), load_robot(spec.robot)


def _show(deviations: Sequence[Deviation], *, as_json: bool, ratios: bool = False) -> None:
    names = [objective.name for objective in OBJECTIVES]
    if as_json:
        documents = []
        for row in deviations:
            values = [value if math.isfinite(value) else None for value in row.ratio.tolist()]
            document: dict[str, Any] = {
                "variant": row.variant,
                "scenario": row.scenario,
                "ratio": dict(zip(names, values, strict=True)),
            }
            if ratios:
                document["quality"] = row.quality if math.isfinite(row.quality) else None
            documents.append(document)
        typer.echo(json.dumps(documents, indent=2))
        return
    table = Table(box=None, header_style="bold", pad_edge=False)
    for heading in ("scenario", "variant"):
        table.add_column(heading, no_wrap=True)
    # f6 is a difference of millimetres, and its ratio says little.
    for heading in ("torque", "accel.", "ang.acc.", "energy", "1/speed"):
        table.add_column(heading, justify="right")
    if ratios:
        table.add_column("quality", justify="right")
    for row in deviations:
        shown = [*row.ratio[:5], row.quality] if ratios else 100.0 * row.relative[:5]
        unit = "" if ratios else " %"
        cells = [f"{value:.2f}{unit}" if math.isfinite(value) else "-" for value in shown]
        table.add_row(row.scenario, row.variant, *cells)
    Console().print(table)
