"""Certificates: specs from options, and results as tables."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Final, cast

from gaitswarm.cli.files import write_walk_logs
from gaitswarm.cli.inputs.design_file import given_design, may_be_file
from gaitswarm.cli.inputs.options import full_id, name_and_value
from gaitswarm.cli.inputs.robots import (
    chosen_robot,
    chosen_scenarios,
    robot_defaults,
    scenario_data,
)
from gaitswarm.cli.inputs.spec_file import parse_spec
from gaitswarm.cli.output import note, print_text, stdout_console
from gaitswarm.cli.tables import MISSING, SHORT, Table, number, results_table, worth
from gaitswarm.requests.simulations import SimulationRequest, run_simulation
from gaitswarm.services.optimizer.errors import InvalidRequest, NotFound
from gaitswarm.services.optimizer.jobs.kinds.certificate import CertificateSpec
from gaitswarm.services.optimizer.jobs.kinds.held_out import certificate_walks
from gaitswarm.sim.mujoco.engines import OWN
from gaitswarm.sim.worlds import PERTURBATIONS

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from gaitswarm.views.certificate import (
        CertificateView,
        ComparedEngineView,
        ComparedView,
        ProportionView,
        SpreadView,
    )

_PLAIN: Final = ("worlds", "seed", "preference", "precision", "engines", "name")
"""Options that are fields of the spec."""


def certificate_spec(design: str, db: str | None, given: Mapping[str, Any]) -> CertificateSpec:
    """Return the spec of a design and options, or of an earlier certificate with options."""
    options = {name: value for name, value in given.items() if value is not None}
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
    if "robot" in options:
        document["robot"] = chosen_robot(options["robot"])
    document |= _perturbations(document, options)
    return cast(CertificateSpec, parse_spec(document))


def _earlier(design: str, db: str | None, options: Mapping[str, Any]) -> dict[str, Any] | None:
    """Return the document of a certificate named by its id; None for any other design."""
    from gaitswarm.jobs.open import open_jobs

    if may_be_file(design):
        return None
    with open_jobs(None, db) as jobs:
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
    robot = options.get("robot")
    given = given_design(design, options.get("controller"), robot=robot, server=None, db=db)
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
    ranges = dict(map(_range, options.get("ranges", ())))
    fixed_values = dict(name_and_value(entry, "set") for entry in options.get("fixed", ()))
    if not ranges and not fixed_values and "only" not in options:
        return {}
    drawn = document.get("variables") or [variable.name for variable in PERTURBATIONS]
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
    """Return name and variable of NAME=LOW:HIGH."""
    name, value = name_and_value(entry, "range", "NAME=LOW:HIGH")
    low, colon, high = value.partition(":")
    if not colon:
        raise InvalidRequest(f"{entry!r} is not NAME=LOW:HIGH", field="range")
    kinds = {variable.name: variable.kind for variable in PERTURBATIONS}
    kind = kinds.get(name, "continuous")
    return name, {"name": name, "low": low, "high": high, "kind": kind}


_STRONGEST = 5
"""Number of perturbations shown."""


def show_certificate(view: CertificateView, place: str) -> None:
    """Print the results of a certificate."""
    console = stdout_console()
    console.print(_by_scenario(view))
    console.print(
        f"{view.worlds} worlds of seed {view.seed}; failures in {_chance(view.failed)}, falls in"
        f" {_chance(view.fell)}",
        markup=False,
    )
    if view.worst:
        console.print(_worst(view))
        console.print(f"to replay the worst: {view.worst[0].replay}{place}", markup=False)
    if view.influences:
        console.print(_influences(view))
    for name, engine in view.engines.items():
        console.print(engine_table(name, engine))
    note(f"job {view.job}; all results: gaitswarm history {view.job}{place}")


def show_world(spec: CertificateSpec, world: int, log: Path | None, *, as_json: bool) -> None:
    """Simulate a certificate's design in one world, and print the results."""
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
    if log is not None:
        write_walk_logs(log, {name: result.log for name, result in view.scenarios.items()})
        note(f"log written to {log}")
    if as_json:
        document = view.model_dump(mode="json", exclude={"scenarios": {"__all__": {"log"}}})
        print_text(json.dumps({"world": request.world, **document}, indent=2, allow_nan=False))
        return
    console = stdout_console()
    console.print(_values(spec, request.world))
    console.print(results_table({"": view.scenarios}, spec.objectives))
    console.print(f"fitness {worth(view)}, in {view.precision} precision", markup=False)


def _values(spec: CertificateSpec, world: Mapping[str, float]) -> Table:
    table = Table(title="The world", title_justify="left", box=None, padding=(0, 2, 0, 0))
    table.add_column("perturbation")
    table.add_column("value", justify="right")
    table.add_column("unit")
    for variable in spec.design_space().columns:
        table.add_row(variable.name, number(world[variable.name]), variable.unit)
    return table


def _by_scenario(view: CertificateView) -> Table:
    table = Table(
        title="Utility by scenario (less is better)",
        title_justify="left",
        box=None,
        padding=(0, 1, 0, 0),
    )
    table.add_column("scenario", no_wrap=True)
    for heading in ("failed", "at most", "nominal", "median", "95 %", "CVaR 95 %", "worst"):
        table.add_column(heading, justify="right")
    for name, scenario in view.scenarios.items():
        label = f"{name} *" if scenario.held_out else name
        table.add_row(label, *_failed(scenario.failed), *_spread(scenario.utility))
    table.add_row("all", *_failed(view.failed), *_spread(view.fitness), style="bold")
    if any(scenario.held_out for scenario in view.scenarios.values()):
        table.caption, table.caption_justify = "* held out: the design was not tuned in it", "left"
    return table


def _failed(share: ProportionView) -> tuple[str, str]:
    return f"{share.count}", f"{100.0 * share.high:.2g} %"


def _spread(spread: SpreadView) -> tuple[str, ...]:
    cvar = number(spread.cvar)
    return (
        number(spread.nominal),
        *("failed" if q is None else number(q) for q in (spread.quantiles[2], spread.quantiles[4])),
        f"> {cvar}" if spread.tail_failed else cvar,
        number(spread.worst),
    )


def _chance(share: ProportionView) -> str:
    return (
        f"{share.count} ({100.0 * share.share:.3g} %; 95 % interval {100.0 * share.low:.2g} to"
        f" {100.0 * share.high:.2g} %)"
    )


def _worst(view: CertificateView) -> Table:
    table = Table(title="Worst worlds", title_justify="left", box=None, padding=(0, 2, 0, 0))
    table.add_column("world", justify="right")
    table.add_column("fitness", justify="right")
    table.add_column("failed in, or worst in")
    for world in view.worst:
        failures = ", ".join(f"{name} ({status})" for name, status in world.failures.items())
        table.add_row(str(world.world), number(world.fitness), failures or world.scenario)
    return table


def _influences(view: CertificateView) -> Table:
    table = Table(
        title="Perturbations in bad worlds (rank correlation with the fitness)",
        title_justify="left",
        box=None,
        padding=(0, 1, 0, 0),
    )
    table.add_column("perturbation")
    for heading in ("correlation", "from", "to"):
        table.add_column(heading, justify="right")
    for influence in view.influences[:_STRONGEST]:
        values = (influence.correlation, influence.low, influence.high)
        table.add_row(influence.name, *(f"{value:+.2f}" for value in values))
    return table


_COMPARED = ("torque", "acceleration", "angular_acceleration", "energy", "reciprocal_speed")
"""Objectives shown; the loss of height, a difference near zero, is only in the JSON."""


def engine_table(name: str, engine: ComparedEngineView) -> Table:
    """Return a table of three rows per scenario: our engine, the other, the relative difference."""
    table = Table(
        title=f"The nominal world in {name}: {engine.description}",
        title_justify="left",
        box=None,
        padding=(0, 1, 0, 0),
    )
    for heading in ("scenario", "engine", "walk"):
        table.add_column(heading, no_wrap=True)
    for heading in (*(SHORT[name] for name in _COMPARED), "utility"):
        table.add_column(heading, justify="right", no_wrap=True)
    for scenario, compared in engine.scenarios.items():
        quantities = [*(compared.objectives[key] for key in _COMPARED), compared.utility]
        table.add_row(scenario, OWN, compared.ours, *(number(q.ours) for q in quantities))
        table.add_row("", name, compared.theirs, *(number(q.theirs) for q in quantities))
        table.add_row("", "difference", "", *_differences(quantities), style="bold")
    blank = [""] * len(_COMPARED)
    table.add_row("all", OWN, "", *blank, number(engine.fitness.ours))
    table.add_row("", name, "", *blank, number(engine.fitness.theirs))
    table.add_row("", "difference", "", *blank, *_differences([engine.fitness]), style="bold")
    return table


def _differences(quantities: Sequence[ComparedView]) -> list[str]:
    return [
        MISSING if quantity.difference is None else f"{100.0 * quantity.difference:+.1f} %"
        for quantity in quantities
    ]
