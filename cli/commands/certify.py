"""`gaitswarm certify`: one design in many worlds and in held-out scenarios."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final, cast

import typer

from gaitswarm.cli.commands.designs import without_logs
from gaitswarm.cli.options import (
    ControllerOption,
    GivenOptions,
    JobName,
    Place,
    Precision,
    PreferenceOption,
    RobotOption,
    TerrainOption,
    WorkerOptions,
    full_id,
    name_and_bounds,
    name_and_value,
)
from gaitswarm.cli.output import Parts, Printed, note
from gaitswarm.cli.tables import MISSING, SHORT, Bold, number, results_table, table, worth
from gaitswarm.services.optimizer.errors import InvalidRequest, NotFound

if TYPE_CHECKING:
    from rich.table import Table

    from gaitswarm.services.optimizer.analysis.certificate import (
        CertificateView,
        ComparedEngineView,
        ComparedView,
        ProportionView,
        SpreadView,
    )
    from gaitswarm.services.optimizer.jobs.kinds.certificate import CertificateSpec


@dataclass
class CertificateOptions(GivenOptions):
    """Options that make the spec; None keeps the value of an earlier certificate.

    Args:
        worlds: Number of worlds. [default: 1000]
        seed: Seed of the worlds. [default: 1]
        scenarios: Names, numbers or FILE.json, separated by commas. Default: those of the job, of
            the robot's folder or of table 4.2, and at least two held-out ones, for a total of
            eight.
        ranges: Draw this perturbation from another range; repeatable.
        fixed: Fix this perturbation in all worlds; repeatable.
        only: Draw only these perturbations; others stay nominal. Default: all.
        engines: Also simulate the nominal world in this engine and show the differences: MuJoCo
            with our contact laws, or with its own contacts. Repeatable; needs pip install
            'gaitswarm[mujoco]'.
    """

    worlds: Annotated[int | None, typer.Option(min=1, max=100_000)] = None
    seed: Annotated[int | None, typer.Option(min=0)] = None
    scenarios: str | None = None
    terrain: TerrainOption = None
    ranges: Annotated[list[str] | None, typer.Option("--range", metavar="NAME=LOW:HIGH")] = None
    fixed: Annotated[list[str] | None, typer.Option("--set", metavar="NAME=VALUE")] = None
    only: Annotated[str | None, typer.Option(metavar="NAME,...")] = None
    controller: ControllerOption = None
    robot: RobotOption = None
    preference: PreferenceOption = None
    precision: Precision = None
    engines: Annotated[
        list[str] | None, typer.Option("--engine", metavar="mujoco|mujoco-contacts")
    ] = None
    name: JobName = None


def certify(
    design: Annotated[str, typer.Argument(metavar="DESIGN|ID")],
    options: CertificateOptions,
    *,
    most: Annotated[int, typer.Option(min=0, max=1000)] = 5,
    replay: Annotated[int | None, typer.Option(metavar="K", min=0, max=99_999)] = None,
    log: Annotated[Path | None, typer.Option(metavar="FILE.npz")] = None,
    workers: WorkerOptions,
) -> Printed:
    """Test a design in many worlds: how often it fails, and how bad it gets.

    A world is one sample of the model's uncertainties: friction, masses, battery, sensors. With
    one seed, world K is the same for every design. Run the same command to resume; with more
    worlds, only the missing ones are simulated.

    Args:
        design: A published design, as published:A; a file with a JSON object {variable: value}, or
            `-` for standard input; the id of a job, for its best with its robot, controller and
            preference; or the id of a certificate to continue.
        most: Worst worlds to list.
        replay: Run no certificate: simulate the design in world K again and show its results.
        log: With --replay: write 500 Hz logs as NumPy arrays.
    """
    from gaitswarm.cli.embedded import Embedded

    spec = _certificate_spec(design, workers.db, options.given)
    if replay is not None:
        return _replayed(spec, replay, log)
    if log is not None:
        raise InvalidRequest("requires --replay", field="log")
    with closing(Embedded(workers)) as embedded:
        job = embedded.run_to_end(spec, any_budget=True)
        view = embedded.jobs.certificate(job.id, worlds=spec.worlds, most=most)
        return view, _parts(view, embedded.jobs.place)


_PLAIN: Final = ("worlds", "seed", "preference", "precision", "engines", "name")
"""Options that are fields of the spec."""


def _certificate_spec(design: str, db: str | None, options: Mapping[str, Any]) -> CertificateSpec:
    """Return the spec of a design and options, or of an earlier certificate with options."""
    from gaitswarm.cli.inputs import chosen_robot, on_terrain, scenario_data
    from gaitswarm.specs import job_spec

    document = _earlier(design, db, options) or _new(design, db, options)
    document |= {name: options[name] for name in _PLAIN if name in options}
    if "scenarios" in options:
        # Names may refer to the earlier certificate's scenarios.
        earlier = {scenario.name: scenario for scenario in document.get("scenarios", ())}
        document["scenarios"] = [
            earlier.get(entry, entry) if isinstance(entry, str) else entry
            for entry in scenario_data(options["scenarios"], options.get("robot"))
        ]
        document |= _still_held_out(document)
    if "terrain" in options:
        document["scenarios"] = on_terrain(document["scenarios"], options["terrain"])
    if "robot" in options:
        document["robot"] = chosen_robot(options["robot"])
    document |= _perturbations(document, options)
    return cast("CertificateSpec", job_spec(document))


def _earlier(design: str, db: str | None, options: Mapping[str, Any]) -> dict[str, Any] | None:
    """Return the document of a certificate named by its id; None for any other design."""
    from gaitswarm.cli.inputs import may_be_file
    from gaitswarm.services.optimizer.jobs.kinds.certificate import CertificateSpec

    if may_be_file(design):
        return None
    with Place(None, db).open() as jobs:
        try:
            spec = jobs.job(full_id(jobs, design)).spec
        except NotFound:
            return None
    if not isinstance(spec, CertificateSpec):
        return None
    if "controller" in options:
        raise InvalidRequest("is set by the certificate; omit it", field="controller")
    document = spec.model_dump() | {"scenarios": spec.resolved_scenarios()}
    # Derived from the number of worlds.
    del document["iterations"]
    return document


def _new(design: str, db: str | None, options: Mapping[str, Any]) -> dict[str, Any]:
    from gaitswarm.cli.inputs import chosen_robot, chosen_scenarios, given_design, robot_defaults
    from gaitswarm.services.optimizer.jobs.kinds.certificate import certificate_walks

    robot = options.get("robot")
    given = given_design(design, options.get("controller"), robot=robot, place=Place(None, db))
    document: dict[str, Any] = {
        "kind": "certificate",
        "name": f"certificate of {given.label}",
        "controller": given.controller,
        "design": given.values,
    }
    if given.spec is None:
        walker, tuned = chosen_robot(robot), chosen_scenarios("all", robot)
        document |= {"robot": walker, "preference": robot_defaults(robot).preference}
    else:
        walker = given.spec.robot if robot is None else chosen_robot(robot)
        tuned = given.spec.resolved_scenarios()
        document |= {"robot": walker, "preference": given.spec.resolved_preference()}
    return document | certificate_walks(tuned, walker, given.values)


def _still_held_out(document: Mapping[str, Any]) -> dict[str, Any]:
    """Return `held_out`, if set, without scenarios that are not used."""
    if document.get("held_out") is None:
        return {}
    walked = {
        entry if isinstance(entry, str) else dict(entry).get("name")
        for entry in document["scenarios"]
    }
    return {"held_out": [name for name in document["held_out"] if name in walked]}


def _perturbations(document: Mapping[str, Any], options: Mapping[str, Any]) -> dict[str, Any]:
    """Return `variables` and `fixed` of the spec if options change them."""
    from gaitswarm.sim.worlds.perturbations import DRAWN

    ranges = dict(map(_range, options.get("ranges", ())))
    fixed_values = dict(name_and_value(entry, "set") for entry in options.get("fixed", ()))
    if not ranges and not fixed_values and "only" not in options:
        return {}
    drawn = document.get("variables") or [variable.name for variable in DRAWN]
    variables = {entry if isinstance(entry, str) else entry["name"]: entry for entry in drawn}
    if "only" in options:
        names = [name.strip() for name in options["only"].split(",")]
        variables = {name: variables.get(name, name) for name in names}
    variables |= ranges
    fixed = {name: v for name, v in document.get("fixed", {}).items() if name not in variables}
    fixed |= fixed_values
    return {
        "variables": [entry for name, entry in variables.items() if name not in fixed],
        "fixed": fixed,
    }


def _range(entry: str) -> tuple[str, dict[str, str]]:
    from gaitswarm.sim.worlds.perturbations import PERTURBATIONS

    name, (low, high) = name_and_bounds(entry, "range")
    kinds = {variable.name: variable.kind for variable in PERTURBATIONS}
    kind = kinds.get(name, "continuous")
    return name, {"name": name, "low": low, "high": high, "kind": kind}


_STRONGEST: Final = 5
"""Number of perturbations shown."""

_COMPARED: Final = ("torque", "acceleration", "angular_acceleration", "energy", "reciprocal_speed")
"""Objectives shown; the loss of height, a difference near zero, is only in the JSON."""


def _parts(view: CertificateView, place: str) -> Parts:
    yield _by_scenario(view)
    yield (
        f"{view.worlds} worlds of seed {view.seed}; failures in {_chance(view.failed)}, falls in"
        f" {_chance(view.fell)}"
    )
    if view.worst:
        worst = (
            (
                *(world.world, number(world.fitness)),
                ", ".join(f"{name} ({status})" for name, status in world.failures.items())
                or world.scenario,
            )
            for world in view.worst
        )
        heads = (">world", "fitness", "<failed in, or worst in")
        yield table(heads, worst, title="Worst worlds")
        yield f"to replay the worst: {view.worst[0].replay}{place}"
    if view.influences:
        strongest = (
            (i.name, *(f"{value:+.2f}" for value in (i.correlation, i.low, i.high)))
            for i in view.influences[:_STRONGEST]
        )
        title = "Perturbations in bad worlds (rank correlation with the fitness)"
        yield table(("perturbation", "correlation", "from", "to"), strongest, title=title, gap=1)
    for name, engine in view.engines.items():
        yield _engine_table(name, engine)
    note(f"job {view.job}; all results: gaitswarm history {view.job}{place}")


def _by_scenario(view: CertificateView) -> Table:
    def cells(failed: ProportionView, spread: SpreadView) -> list[str]:
        cvar = number(spread.cvar)
        quantiles = (spread.quantiles[2], spread.quantiles[4])
        return [
            *(f"{failed.count}", f"{100.0 * failed.high:.2g} %", number(spread.nominal)),
            *("failed" if quantile is None else number(quantile) for quantile in quantiles),
            *(f"> {cvar}" if spread.tail_failed else cvar, number(spread.worst)),
        ]

    rows = [
        [f"{name} *" if scenario.held_out else name, *cells(scenario.failed, scenario.utility)]
        for name, scenario in view.scenarios.items()
    ]
    heads = ("failed", "at most", "nominal", "median", "95 %", "CVaR 95 %", "worst")
    made = table(
        ["scenario", *heads],
        [*rows, Bold(["all", *cells(view.failed, view.fitness)])],
        title="Utility by scenario (less is better)",
        gap=1,
    )
    if any(scenario.held_out for scenario in view.scenarios.values()):
        made.caption, made.caption_justify = "* held out: the design was not tuned in it", "left"
    return made


def _chance(share: ProportionView) -> str:
    return (
        f"{share.count} ({100.0 * share.share:.3g} %; 95 % interval {100.0 * share.low:.2g} to"
        f" {100.0 * share.high:.2g} %)"
    )


def _engine_table(name: str, engine: ComparedEngineView) -> Table:
    """Return a table of three rows per scenario: our engine, the other, the relative difference."""
    from gaitswarm.sim.mujoco.engines import OWN

    def differences(quantities: list[ComparedView]) -> list[str]:
        return [
            MISSING if q.difference is None else f"{100.0 * q.difference:+.1f} %"
            for q in quantities
        ]

    rows: list[list[str]] = []
    for scenario, compared in engine.scenarios.items():
        quantities = [*(compared.objectives[key] for key in _COMPARED), compared.utility]
        rows.append([scenario, OWN, compared.ours, *(number(q.ours) for q in quantities)])
        rows.append(["", name, compared.theirs, *(number(q.theirs) for q in quantities)])
        rows.append(Bold(["", "difference", "", *differences(quantities)]))
    blank = [""] * len(_COMPARED)
    rows.append(["all", OWN, "", *blank, number(engine.fitness.ours)])
    rows.append(["", name, "", *blank, number(engine.fitness.theirs)])
    rows.append(Bold(["", "difference", "", *blank, *differences([engine.fitness])]))
    heads = ["scenario", "<engine", "<walk", *(SHORT[key] for key in _COMPARED), "utility"]
    return table(heads, rows, title=f"The nominal world in {name}: {engine.description}", gap=1)


def _replayed(spec: CertificateSpec, world: int, log: Path | None) -> tuple[dict[str, Any], Parts]:
    from gaitswarm.services.optimizer.jobs.designs import SimulationRequest
    from gaitswarm.simulation import run_simulation

    request = SimulationRequest(
        robot=spec.robot,
        controller=spec.controller,
        design=spec.design,
        scenarios=spec.scenarios,
        preference=spec.preference,
        precision=spec.precision,
        world=spec.world(world),
        log=log is not None,
    )
    view = run_simulation(request)

    def parts() -> Parts:
        columns = spec.design_space().columns
        rows = ((v.name, number(request.world[v.name]), v.unit) for v in columns)
        yield table(("perturbation", "value", "<unit"), rows, title="The world")
        yield results_table({"": view.scenarios}, spec.objectives)
        yield f"fitness {worth(view)}, in {view.precision} precision"

    return {"world": request.world, **without_logs(view, log)}, parts()
