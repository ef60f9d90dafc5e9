"""What other engines make of a design, for people."""

from __future__ import annotations

from typing import TYPE_CHECKING

from gaitswarm.cli.tables.fitted import Table
from gaitswarm.cli.tables.views import MISSING, SHORT, number
from gaitswarm.sim.mujoco.engines import OWN

_COMPARED = ("torque", "acceleration", "angular_acceleration", "energy", "reciprocal_speed")
"""The loss of height, a difference near zero, is in the JSON."""

if TYPE_CHECKING:
    from collections.abc import Sequence

    from gaitswarm.views.certificate import ComparedEngineView, ComparedView


def engine_table(name: str, engine: ComparedEngineView) -> Table:
    """Three rows a scenario: by our engine, by the other one, and by how much the latter is more"""
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
    for scenario, found in engine.scenarios.items():
        quantities = [*(found.objectives[key] for key in _COMPARED), found.utility]
        table.add_row(scenario, OWN, found.ours, *_ours(quantities))
        table.add_row("", name, found.theirs, *_theirs(quantities))
        table.add_row("", "difference", "", *_differences(quantities), style="bold")
    blank = [""] * len(_COMPARED)
    fitness = [engine.fitness]
    table.add_row("all", OWN, "", *blank, *_ours(fitness))
    table.add_row("", name, "", *blank, *_theirs(fitness))
    table.add_row("", "difference", "", *blank, *_differences(fitness), style="bold")
    return table


def _ours(quantities: Sequence[ComparedView]) -> list[str]:
    return [number(quantity.ours) for quantity in quantities]


def _theirs(quantities: Sequence[ComparedView]) -> list[str]:
    return [number(quantity.theirs) for quantity in quantities]


def _differences(quantities: Sequence[ComparedView]) -> list[str]:
    return [
        MISSING if quantity.difference is None else f"{100.0 * quantity.difference:+.1f} %"
        for quantity in quantities
    ]
