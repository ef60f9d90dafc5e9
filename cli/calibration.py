"""Calibration: files of targets, and fitted parameters as tables and pictures."""

from __future__ import annotations

import csv
import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from gaitswarm.cli.inputs.design_file import read_design
from gaitswarm.cli.inputs.spec_file import read_json_object
from gaitswarm.cli.output import note, print_json, stdout_console
from gaitswarm.cli.tables import MISSING, Table, number
from gaitswarm.services.optimizer.errors import InvalidRequest
from gaitswarm.settings import place_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from pydantic import BaseModel

    from gaitswarm.views.calibration import ReachedView, TargetsView
    from gaitswarm.views.identification import IdentifiabilityView, ParameterView

_NEEDED: Final = ("walk", "controller", "design", "scenario", "quantity", "value", "tolerance")
_OPTIONAL: Final = ("relative_to", "use")
_OF_WALK: Final = ("controller", "design", "scenario")

_LARGEST: Final = 1 << 20
"""Largest accepted table [B]."""


def read_targets(path: Path) -> dict[str, list[dict[str, Any]]]:
    """Read walks and targets of a spec of kind `calibration`; errors name line and column.

    path: a CSV file with a header; empty lines and lines that start with # are ignored. A walk's
        controller, design and scenario may be empty in its later rows. Files of designs and
        scenarios are relative to the table's folder.
    """
    walks: dict[str, dict[str, Any]] = {}
    cells_of: dict[str, dict[str, str]] = {}
    targets = []
    for line, row in _rows(path):
        name = row["walk"]
        cells = {column: row[column] for column in _OF_WALK}
        if name in walks:
            for column, cell in cells.items():
                if cell not in ("", cells_of[name][column]):
                    raise _refusal(
                        path, line, column, f"differs from an earlier row of walk {name!r}"
                    )
        else:
            walks[name] = _walk(path, line, name, cells)
            cells_of[name] = cells
        targets.append(_target(path, line, row, walks))
    if not targets:
        raise InvalidRequest(f"{path} has no rows", field="targets")
    return {"walks": list(walks.values()), "targets": targets}


def _rows(path: Path) -> Iterator[tuple[int, dict[str, str]]]:
    """Yield line numbers and stripped cells by column."""
    try:
        with path.open(encoding="utf-8-sig", newline="") as file:
            text = file.read(_LARGEST + 1)
    except (OSError, UnicodeDecodeError) as error:
        raise InvalidRequest(f"cannot read {path}: {error}", field="targets") from error
    if len(text) > _LARGEST:
        raise InvalidRequest(f"{path} is larger than {_LARGEST >> 20} MiB", field="targets")
    reader = csv.reader(text.splitlines(), strict=True, skipinitialspace=True)
    header: list[str] | None = None
    try:
        for row in reader:
            cells = [cell.strip() for cell in row]
            if not any(cells) or cells[0].startswith("#"):
                continue
            if header is None:
                header = _header(path, reader.line_num, cells)
            elif len(cells) > len(header):
                raise _refusal(
                    path, reader.line_num, header[-1], "the line has more cells than the header"
                )
            else:
                named = dict(zip(header, cells, strict=False))
                yield reader.line_num, dict.fromkeys((*_NEEDED, *_OPTIONAL), "") | named
    except csv.Error as error:
        raise InvalidRequest(f"{path}, line {reader.line_num}: {error}", field="targets") from error


def _header(path: Path, line: int, columns: list[str]) -> list[str]:
    allowed = (*_NEEDED, *_OPTIONAL)
    for column in columns:
        if column not in allowed:
            names = ", ".join(allowed)
            raise _refusal(path, line, column, f"unknown column; known are {names}")
        if columns.count(column) > 1:
            raise _refusal(path, line, column, "duplicate column")
    for column in _NEEDED:
        if column not in columns:
            raise _refusal(path, line, column, "missing column")
    return columns


def _walk(path: Path, line: int, name: str, cells: Mapping[str, str]) -> dict[str, Any]:
    from gaitswarm.sim.calibration.targets import TargetWalk

    for column, cell in cells.items():
        if not cell:
            raise _refusal(path, line, column, f"required in the first row of walk {name!r}")
    document = {
        "name": name,
        "controller": cells["controller"],
        "design": _design(path, line, cells),
        "scenarios": [
            _scenario(path, line, entry) if entry.endswith(".json") else entry
            for entry in cells["scenario"].split()
        ],
    }
    columns = {"name": "walk", "scenarios": "scenario"}
    return _checked(path, line, TargetWalk, document, columns).model_dump(mode="json")


def _scenario(path: Path, line: int, name: str) -> dict[str, Any]:
    try:
        return read_json_object(path.parent / name, "scenario")
    except InvalidRequest as error:
        message = str(error).removeprefix("scenario: ")
        raise _refusal(path, line, "scenario", message) from error


def _design(path: Path, line: int, cells: Mapping[str, str]) -> dict[str, Any]:
    cell = cells["design"]
    try:
        if cell.startswith("{"):
            design = json.loads(cell)
            return dict(design)
        if not cell.startswith("published:"):
            cell = str(path.parent / cell)
        return read_design(cell, cells["controller"])
    except InvalidRequest as error:
        column = "controller" if error.field == "controller" else "design"
        raise _refusal(path, line, column, str(error).removeprefix("design: ")) from error
    except ValueError as error:
        raise _refusal(path, line, "design", f"not JSON: {error}") from error


def _target(
    path: Path, line: int, row: Mapping[str, str], walks: Mapping[str, dict[str, Any]]
) -> dict[str, Any]:
    from gaitswarm.sim.calibration.targets import QUANTITIES, Target

    document: dict[str, Any] = {
        "walk": row["walk"],
        "quantity": row["quantity"],
        "relative_to": row["relative_to"] or None,
        "use": row["use"] or "fit",
    }
    for column in ("value", "tolerance"):
        try:
            document[column] = float(row[column])
        except ValueError as error:
            raise _refusal(path, line, column, f"{row[column]!r} is not a number") from error
    target = _checked(path, line, Target, document, {})
    scenarios = len(walks[row["walk"]]["scenarios"])
    if scenarios > 1 and not QUANTITIES[document["quantity"]].scenarios:
        raise _refusal(
            path, line, "quantity", f"applies to one scenario, but the walk has {scenarios}"
        )
    return target.model_dump(mode="json")


def _checked(
    path: Path,
    line: int,
    model: type[BaseModel],
    document: dict[str, Any],
    columns: Mapping[str, str],
) -> BaseModel:
    """Validate a document; columns: those of fields with another name in the table."""
    from pydantic import ValidationError

    from gaitswarm.sim.input import message_of, without_tags

    try:
        return model.model_validate(document)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        message = message_of(first)
        location = without_tags(first["loc"])
        if location:
            field = str(location[0])
            if len(location) > 1 and field == "design":
                message = f"{location[1]}: {message}"
        else:
            # Validators of the whole document put the field first.
            field, _, message = message.partition(": ")
        raise _refusal(path, line, columns.get(field, field), message) from error


def _refusal(path: Path, line: int, column: str, message: str) -> InvalidRequest:
    return InvalidRequest(f"{path}, line {line}, column {column}: {message}", field="targets")


def show_targets(reached: TargetsView, parameters: IdentifiabilityView) -> None:
    """Print the result of `calibrate` and `targets`."""
    console = stdout_console()
    console.print(targets_table(reached))
    console.print(
        f"misfit {reached.fitness:.3f} tolerances (root mean square over fitted targets): job"
        f" {reached.job}, design {place_of(reached.iteration, reached.particle)}",
        markup=False,
    )
    for job, fitness in zip(parameters.jobs, parameters.fitness, strict=True):
        console.print(f"job {job}: misfit {fitness:.3f}", markup=False)
    console.print(parameters_table(parameters, {}))
    if any(parameter.choices for parameter in parameters.parameters):
        console.print(choices_table(parameters))
    if len(parameters.jobs) == 1:
        note("note: a single run always converges; runs with other seeds show what is reliable")


def targets_table(reached: TargetsView) -> Table:
    """Return a table of targets, simulated values and differences."""
    left_out = any(target.left_out is not None for target in reached.targets)
    title = "Targets; off: difference in tolerances"
    table = Table(title=title, title_justify="left", box=None, padding=(0, 1, 0, 0))
    for column in ("walk", "quantity", "unit"):
        table.add_column(column, overflow="fold")
    columns = ("target", "simulated", "off", *(("left out", "off") if left_out else ()))
    for column in columns:
        table.add_column(column, justify="right")
    table.add_column("")
    for t in reached.targets:
        walk = t.walk if t.relative_to is None else f"{t.walk} / {t.relative_to}"
        table.add_row(
            walk,
            t.quantity,
            t.unit,
            number(t.value),
            number(t.simulated),
            _off(t),
            *(_left_out(t.left_out) if left_out else ()),
            "" if t.use == "fit" else "predict",
        )
    return table


def choices_table(parameters: IdentifiabilityView) -> Table:
    """Return a table of the least misfit with each choice, over all runs and by run."""
    title = "Least misfit by choice"
    table = Table(title=title, title_justify="left", box=None, padding=(0, 1, 0, 0))
    for column in ("variable", "choice"):
        table.add_column(column, no_wrap=True)
    for column in ("misfit", *(f"run {k}" for k in range(1, len(parameters.jobs) + 1))):
        table.add_column(column, justify="right")
    table.add_column("evidence")
    for parameter in parameters.parameters:
        for row, choice in enumerate(parameter.choices):
            table.add_row(
                "" if row else parameter.name,
                choice.name,
                number(choice.fitness),
                *map(number, choice.by_run),
                "" if row else parameter.explanation or "one run",
            )
    return table


def _left_out(reached: ReachedView | None) -> tuple[str, str]:
    return (MISSING if reached is None else number(reached.simulated)), _off(reached)


def _off(reached: ReachedView | None) -> str:
    if reached is None or reached.difference is None:
        return MISSING
    return f"{reached.difference:+.2f}"


_SHOWN: Final = (0.2, 0.1, 0.05, 0.02)
"""Thresholds shown in tables; JSON and the picture contain all twelve."""

_STYLES: Final = {"trusted": "green", "rough": "yellow", "unknown": "red"}


def read_truth(path: Path | None) -> dict[str, float]:
    """Read true values by name; none without a file."""
    values = {} if path is None else read_json_object(path, "truth")
    for name, value in values.items():
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise InvalidRequest("must be a number", field=f"truth.{name}")
    return values


def show_parameters(
    view: IdentifiabilityView, truth: Mapping[str, float], *, as_json: bool
) -> None:
    """Print the result of `identify` and `parameters`."""
    if as_json:
        print_json(view)
        return
    console = stdout_console()
    console.print(parameters_table(view, truth))
    for job, fitness in zip(view.jobs, view.fitness, strict=True):
        console.print(f"job {job}: mean error of currents {1000 * fitness:.2f} mA", markup=False)
    if len(view.jobs) == 1:
        note("note: a single run always converges; runs with other seeds show what is reliable")


def parameters_table(view: IdentifiabilityView, truth: Mapping[str, float]) -> Table:
    """Return a table of best and true values, and of intervals' widths in percent."""
    from rich.text import Text

    title = "Fitted parameters; widths of their intervals in % of the range searched"
    table = Table(title=title, title_justify="left", box=None, padding=(0, 1, 0, 0))
    table.add_column("parameter", no_wrap=True)
    table.add_column("unit")
    table.add_column("best", justify="right")
    if truth:
        table.add_column("true", justify="right")
    for threshold in _SHOWN:
        table.add_column(f"{threshold:.0%}", justify="right")
    table.add_column("trust")
    for p in view.parameters:
        table.add_row(
            p.name,
            p.unit,
            number(p.best),
            *([number(truth.get(p.name))] if truth else []),
            *(f"{100 * _width(view, p, threshold):.0f}" for threshold in _SHOWN),
            Text(p.trust or "one run", style=_STYLES.get(p.trust or "", "")),
        )
    return table


def draw_parameters(view: IdentifiabilityView, truth: Mapping[str, float]) -> Figure:
    """Draw one panel per parameter: its interval against the threshold (fig. 2.14)."""
    from matplotlib.figure import Figure

    columns = min(len(view.parameters), 6)
    rows = -(-len(view.parameters) // columns)
    figure = Figure(figsize=(2.2 * columns, 1.6 * rows + 0.6), layout="constrained")
    panels = figure.subplots(rows, columns, squeeze=False, sharex=True).ravel()
    across = [100.0 * threshold for threshold in view.thresholds]
    for axes, p in zip(panels, view.parameters, strict=False):
        axes.fill_between(
            across,
            [interval.low for interval in p.intervals],
            [interval.high for interval in p.intervals],
            color="#9db8d9",
            lw=0,
        )
        for choice, name in enumerate(c.name for c in p.choices):
            axes.text(100.0, choice, name, fontsize=5, va="center", ha="right")
        axes.axhline(_height(p, p.best), color="#1f3a5f", lw=1.0)
        if p.name in truth:
            axes.axhline(truth[p.name], color="#d1495b", lw=1.0, ls="--")
        axes.set_ylim(p.low, p.high)
        axes.set_xscale("log")
        axes.set_title(f"{p.name} [{p.unit}]", fontsize=6, loc="left")
        axes.tick_params(labelsize=6)
        axes.spines[["top", "right"]].set_visible(False)
    for axes in panels[len(view.parameters) :]:
        axes.set_visible(False)
    figure.supxlabel("fitness above its run's best  [%]", fontsize=8)
    return figure


def _height(p: ParameterView, value: float | str) -> float:
    """Return a value's height in its panel: a choice's index; below the panel if unknown."""
    if not isinstance(value, str):
        return value
    names = [choice.name for choice in p.choices]
    return float(names.index(value)) if value in names else -1.0


def _width(view: IdentifiabilityView, p: ParameterView, threshold: float) -> float:
    """Return the interval's width as a share of the search range."""
    interval = p.intervals[view.thresholds.index(threshold)]
    return (interval.high - interval.low) / (p.high - p.low)
