"""Commands about single designs: simulate, robustness, firmware, trajectories."""

from __future__ import annotations

import time
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from gaitswarm.cli.options import (
    ControllerOption,
    Place,
    Precision,
    PreferenceOption,
    RobotOption,
    TerrainOption,
    TrajectoryOption,
)
from gaitswarm.cli.output import Parts, Printed, note, replacing
from gaitswarm.cli.tables import (
    SHORT,
    Bold,
    gait_in_words,
    interval,
    measurements_tables,
    number,
    results_table,
    table,
    worth,
)

if TYPE_CHECKING:
    from gaitswarm.firmware import FirmwareView, TrajectoriesView
    from gaitswarm.services.optimizer.analysis.robustness import RobustnessView
    from gaitswarm.simulation import SimulationView


def simulate(
    design: Annotated[str, typer.Option(metavar="JSON|FILE|published:NAME|job:ID")],
    controller: ControllerOption = None,
    scenario: str | None = None,
    terrain: TerrainOption = None,
    trajectory: TrajectoryOption = None,
    preference: PreferenceOption = None,
    world: Annotated[str | None, typer.Option(metavar="JSON|FILE")] = None,
    log: Annotated[Path | None, typer.Option(metavar="FILE.npz")] = None,
    robot: RobotOption = None,
    precision: Precision = None,
    *,
    place: Place,
) -> Printed:
    """Simulate one design and show its objectives and fitness; a fall is a result, not an error.

    Args:
        design: JSON object {variable: value} of controller variables and optional gait parameters,
            or with one under `design`; a published design, as published:A; or the best of a job.
        scenario: Names, numbers or FILE.json, separated by commas, or all; of the robot's folder if
            it has scenarios, else of table 4.2 [default: the job's, else all].
        world: Perturbations of the model, such as '{"friction_factor": 0.7, "slope_added": 2}', or
            an object with them under `values`, as printed by `certify --json`.
        log: Write 500 Hz logs as NumPy arrays.
    """
    from gaitswarm.cli.inputs import given_design, json_object, on_terrain, robot_defaults
    from gaitswarm.services.optimizer.jobs.designs import SimulationRequest
    from gaitswarm.simulation import run_simulation
    from gaitswarm.specs import checked

    given = given_design(design, controller, trajectory, robot=robot, place=place)
    data: dict[str, Any] = {
        "robot": given.robot(robot),
        "controller": given.controller,
        "design": given.values,
        "scenarios": given.scenarios(scenario, robot),
        "preference": preference or robot_defaults(robot).preference,
        "precision": precision or "double",
        "log": log is not None,
    }
    if terrain is not None:
        data["scenarios"] = on_terrain(data["scenarios"], terrain)
    if given.spec is not None and preference is None:
        data["preference"] = given.spec.preference
    if world is not None:
        document = json_object(world, "world")
        data["world"] = document.get("values", document)
    view = run_simulation(checked(SimulationRequest, data))
    return without_logs(view, log), _simulated(view)


def without_logs(view: SimulationView, path: Path | None) -> dict[str, Any]:
    """Write the logs of a simulation if there is a path; return the rest as JSON.

    The NumPy archive has one array per quantity, as named in `WalkLog`; with several scenarios,
    `<scenario>/<name>`.
    """
    if path is not None:
        import numpy as np

        logs = {name: result.log for name, result in view.scenarios.items()}
        arrays = {
            f"{scenario}/{name}" if len(logs) > 1 else name: np.array(
                column.values, dtype=np.float64
            )
            for scenario, log in logs.items()
            if log is not None
            for name, column in log.columns.items()
        }
        with replacing(path, "log") as file:
            np.savez_compressed(file, allow_pickle=False, **arrays)
        note(f"log written to {path}")
    return view.model_dump(mode="json", exclude={"scenarios": {"__all__": {"log"}}})


def _simulated(view: SimulationView) -> Parts:
    from gaitswarm.sim.outcome import MEASUREMENTS, OBJECTIVES

    yield results_table({"": view.scenarios}, OBJECTIVES)
    measured = {name: result.measurements for name, result in view.scenarios.items()}
    yield from measurements_tables(measured, MEASUREMENTS)
    yield f"fitness {worth(view)}, in {view.precision} precision"
    for name, result in view.scenarios.items():
        if result.gait is not None:
            yield f"{name}: {gait_in_words(result.gait)}"
        if result.status != "ok":
            yield f"{name}: {result.explanation}"


def robustness(
    design: Annotated[str, typer.Argument(metavar="DESIGN|ID")],
    samples: int = 256,
    radius: float = 0.02,
    seed: int = 1,
    scenarios: Annotated[
        str | None, typer.Option(show_default="those of the job, else all of the robot")
    ] = None,
    controller: ControllerOption = None,
    robot: RobotOption = None,
    precision: Precision = None,
    *,
    place: Place,
) -> Printed:
    """Estimate the robustness index of a design (thesis 4.4.3); smaller is more robust.

    It is the norm of the Jacobian of the objectives' logarithms with respect to the variables as
    shares of their bounds, from a regression over designs sampled around the given one.

    Args:
        design: Design file, `-`, or published:NAME, as for `simulate`; or a job's id for its best.
        samples: Designs to sample around each given one.
        radius: Radius of the sample, as a share of each variable's bounds.
        seed: Seed of the sample.
        scenarios: Names, numbers or FILE.json, separated by commas, or all.
    """
    from gaitswarm.cli.inputs import given_design, robot_defaults
    from gaitswarm.services.optimizer.analysis.robustness import RobustnessRequest
    from gaitswarm.simulation import run_robustness
    from gaitswarm.specs import checked

    given = given_design(design, controller, robot=robot, place=place)
    if given.spec is None:
        variables = robot_defaults(robot).of_controller(given.controller).get("variables")
    else:
        variables = given.spec.design_space().variables
    data = {
        "controller": given.controller,
        "design": given.values,
        "samples": samples,
        "radius": radius,
        "seed": seed,
        "precision": precision or "double",
        "scenarios": given.scenarios(scenarios, robot),
        "robot": given.robot(robot),
        "variables": variables,
    }
    last = time.monotonic()

    def progress(done: int, planned: int) -> None:
        nonlocal last
        if done < planned and time.monotonic() - last >= 2.0:
            last = time.monotonic()
            note(f"{done} of {planned} simulations")

    view = run_robustness(checked(RobustnessRequest, data), progress=progress)
    return view, _robustness(view)


def _robustness(view: RobustnessView) -> Parts:
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
    if view.held:
        yield f"fixed: {', '.join(view.held)}"


@dataclass(frozen=True, slots=True)
class FolderOptions:
    """A design, and the folder to which it is written.

    Args:
        design: published:NAME, a file as for `simulate`, `-`, or a job's id for its best.
        output: New folder.
        scenarios: Names, numbers or FILE.json, separated by commas, or all [default: the job's,
            else all].
    """

    design: Annotated[str, typer.Argument(metavar="DESIGN|ID")]
    output: Annotated[Path, typer.Option("--output", "-o", metavar="FOLDER")]
    scenarios: str | None = None
    controller: ControllerOption = None
    robot: RobotOption = None

    def read(self, place: Place) -> tuple[str, dict[str, Any]]:
        """Return the design's label, and arguments of the function that writes the folder."""
        from gaitswarm.cli.inputs import chosen_scenarios, given_design

        given = given_design(self.design, self.controller, robot=self.robot, place=place)
        if given.spec is None or self.scenarios is not None:
            scenarios = chosen_scenarios(self.scenarios or "all", self.robot)
        else:
            scenarios = given.spec.resolved_scenarios()
        return given.label, {
            "design": given.values,
            "output": self.output,
            "scenarios": scenarios,
            "controller": given.controller,
            "robot": given.robot(self.robot),
        }


def firmware(
    options: FolderOptions,
    table_bits: Annotated[str | None, typer.Option(metavar="ERRORxCURRENT")] = None,
    *,
    place: Place,
) -> Printed:
    """Write a design as C for the robot's microcontrollers, with a test against simulations.

    Args:
        table_bits: Bits of a fuzzy table's indices, also for the simulations [default: 10x6].
    """
    from gaitswarm.firmware import write_firmware

    label, arguments = options.read(place)
    bits = None if table_bits is None else _bits(table_bits)
    view = write_firmware(**arguments, label=label, table_bits=bits)
    return view, _firmware(view)


def _bits(text: str) -> tuple[int, int]:
    from gaitswarm.services.optimizer.errors import simulation_errors
    from gaitswarm.sim.firmware.folder import parsed_table_bits

    with simulation_errors("table_bits"):
        return parsed_table_bits(text)


def _firmware(view: FirmwareView) -> Parts:
    heads = ("walk", "samples", "rows at 500 Hz", "columns", "B", "B of a leg")
    rows = (
        (
            *(walk.scenario, walk.status, walk.samples, gait.rows, gait.columns),
            *(gait.bytes, gait.bytes_of_a_leg),
        )
        for walk, gait in zip(view.walks, view.trajectories, strict=True)
    )
    yield table(["scenario", *heads], rows)
    memory = view.memory
    yield (
        f"tables: {memory.tables} B of the {memory.flash} B of flash of an {memory.processor};"
        f" state between ticks: {memory.remembered} B of {memory.ram} B of RAM"
    )
    if view.table_difference is not None:
        differences = ", ".join(
            f"{name.replace('_', ' ')} {'unknown' if share is None else f'{share:.2%}'}"
            for name, share in view.table_difference.items()
        )
        yield f"largest differences from 10 x 6 bits: {differences}"
    for remark in memory.remarks:
        yield f"does not fit: {remark}"
    note(f"{len(view.files)} files written; to compare {view.samples} samples, run")
    note(f"  make -C {view.folder} test")


def trajectories(
    options: FolderOptions,
    rate: Annotated[
        float,
        typer.Option(help="Rows a second, changed so that a cycle has a whole number of them."),
    ] = 50.0,
    *,
    held: Annotated[
        bool, typer.Option("--held/--no-held", help="Include joints that are held at an angle.")
    ] = True,
    place: Place,
) -> Printed:
    """Write a design's joint angles for position-controlled servos, as CSV and for ROS 2."""
    from gaitswarm.firmware import write_trajectories

    _, arguments = options.read(place)
    view = write_trajectories(**arguments, rate=rate, held=held)
    return view, _trajectories(view)


def _trajectories(view: TrajectoriesView) -> Parts:
    heads = ("ms by row", "rows of start", "of cycle", "of stop", "largest rad/s", "of joint")
    rows = (
        (of.scenario, 1e3 * of.step, *of.rows.values(), of.largest_speed, of.fastest_joint)
        for of in view.scenarios
    )
    yield table(["scenario", *heads], rows)
    for of in view.scenarios:
        for joint, (speed, no_load) in of.too_fast.items():
            note(
                f"warning: {of.scenario}: {joint} turns at {speed:.3g} rad/s,"
                f" {speed / no_load - 1.0:.0%} faster than its motor without load"
                f" ({no_load:.3g} rad/s)"
            )
    note(f"{len(view.files)} files of {len(view.joints)} joints written to {view.folder}")
