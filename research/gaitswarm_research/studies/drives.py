"""The drive of 2011 against that of 2016 (thesis table 5.1)."""

from __future__ import annotations

import json
from typing import Annotated, Any, Final

import typer
from rich.console import Console
from rich.table import Table

from gaitswarm import CONTROLLERS, SCENARIOS, RobotVariant, Scenario, Status, simulate
from gaitswarm_research import options

UPDATES_PER_CYCLE: Final = 42
"""New targets per cycle: 20 points of support, 20 of swing, and the two ends of the stride."""


def driven_as_in_2011(scenario: Scenario) -> Scenario:
    """Return a scenario with the trajectory of 2011 and its own cycle time (appendix .2.1)."""
    fields = {
        "curve": "quadratic_spline",
        "duty_factor": 0.5,
        "duty_phase": "support",
        "trajectory_rate": UPDATES_PER_CYCLE / scenario.cycle_time,
        "fir_ms": 0,
        "start_phase": 0.5,
        "turn_mode": "both",
    }
    return Scenario.model_validate(scenario.model_dump() | fields)


def figures(drive: str, scenario: Scenario, robot: str) -> dict[str, Any]:
    """Return status, speed [m/s], power [W] and effectivity [m/J] of a drive in a scenario."""
    old = drive == "2011"
    controller, study = ("p", "2011") if old else ("fuzzy-pi", "A")
    result = simulate(
        CONTROLLERS[controller].published[study],
        controller=controller,
        scenarios=driven_as_in_2011(scenario) if old else scenario,
        robot=robot,
    )
    energy, pace = result.objectives[0, 0, 3:5].tolist()
    return {
        "drive": drive,
        "scenario": scenario.name,
        "status": Status(int(result.statuses[0, 0])).label,
        "speed": 1.0 / pace,
        "power": energy / pace,
        "effectivity": 1.0 / energy,
    }


def drives(
    robot: Annotated[str, typer.Option(help="Robot by name.")] = RobotVariant().name,
    as_json: options.Json = False,
) -> None:
    """Compare the drive of 2011 with the Fuzzy-PI of 2016 in the six scenarios (table 5.1)."""
    rows = [figures(drive, scenario, robot) for scenario in SCENARIOS for drive in ("2011", "2016")]
    if as_json:
        typer.echo(json.dumps(rows, indent=2))
        return
    table = Table(box=None, header_style="bold", pad_edge=False)
    for heading in ("scenario", "drive", "status", "speed m/s", "power W", "effectivity m/J"):
        table.add_column(heading, no_wrap=True)
    for row in rows:
        numbers = (f"{row[name]:.4g}" for name in ("speed", "power", "effectivity"))
        table.add_row(row["scenario"], row["drive"], row["status"], *numbers)
    Console().print(table)
