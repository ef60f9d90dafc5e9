"""A certificate for people: how often a design fails, how bad it gets, and where."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

from gaitswarm.cli.output import note, print_text, stdout_console
from gaitswarm.cli.tables.engines import engine_table
from gaitswarm.cli.tables.fitted import Table
from gaitswarm.cli.tables.views import number

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from gaitswarm.services.optimizer.jobs.kinds.certificate import CertificateSpec
    from gaitswarm.views.certificate import (
        CertificateView,
        ProportionView,
        SpreadView,
    )

_STRONGEST = 5
"""Perturbations that are named."""


def show_certificate(view: CertificateView, place: str) -> None:
    """Print what a design came to in many worlds."""
    console = stdout_console()
    console.print(_by_scenario(view))
    console.print(
        f"{view.worlds} worlds of seed {view.seed}; a walk failed in {_chance(view.failed)}, the"
        f" robot fell in {_chance(view.fell)}",
        markup=False,
    )
    if view.worst:
        console.print(_worst(view))
        console.print(f"see the worst again: {view.worst[0].replay}{place}", markup=False)
    if view.influences:
        console.print(_influences(view))
    for name, engine in view.engines.items():
        console.print(engine_table(name, engine))
    note(f"job {view.job}; its walks: gaitswarm history {view.job}{place}")


def show_world(spec: CertificateSpec, world: int, log: Path | None, *, as_json: bool) -> None:
    """Let a certificate's design walk in one world, and print its results."""
    from gaitswarm.cli.tables.views import results_table, worth
    from gaitswarm.cli.walk_log import write_walk_logs
    from gaitswarm.requests.simulations import SimulationRequest, run_simulation

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
    for name, found in view.scenarios.items():
        marked = f"{name} *" if found.held_out else name
        table.add_row(marked, *_failed(found.failed), *_spread(found.utility))
    table.add_row("all", *_failed(view.failed), *_spread(view.fitness), style="bold")
    if any(found.held_out for found in view.scenarios.values()):
        table.caption, table.caption_justify = "* held out: the design was not tuned in it", "left"
    return table


def _failed(found: ProportionView) -> tuple[str, str]:
    return f"{found.count}", f"{100.0 * found.high:.2g} %"


def _spread(spread: SpreadView) -> tuple[str, ...]:
    # A walk that failed is worse than any other.
    worst = number(spread.worst)
    cvar = number(spread.cvar)
    return (
        number(spread.nominal),
        _quantile(spread.quantiles[2]),
        _quantile(spread.quantiles[4]),
        f"> {cvar}" if spread.tail_failed else cvar,
        worst,
    )


def _quantile(value: float | None) -> str:
    return "failed" if value is None else number(value)


def _chance(found: ProportionView) -> str:
    return (
        f"{found.count} ({100.0 * found.share:.3g} %; 95 % interval {100.0 * found.low:.2g} to"
        f" {100.0 * found.high:.2g} %)"
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
        title="What goes with bad worlds (rank correlation with the fitness)",
        title_justify="left",
        box=None,
        padding=(0, 1, 0, 0),
    )
    table.add_column("perturbation")
    for heading in ("correlation", "from", "to"):
        table.add_column(heading, justify="right")
    for found in view.influences[:_STRONGEST]:
        table.add_row(
            found.name, *(f"{v:+.2f}" for v in (found.correlation, found.low, found.high))
        )
    return table
