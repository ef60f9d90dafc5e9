"""Tables of calibration targets."""

from __future__ import annotations

import csv
import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from gaitswarm.cli.inputs import read_design, read_json_object
from gaitswarm.services.optimizer.errors import InvalidRequest

if TYPE_CHECKING:
    from pydantic import BaseModel

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
    from gaitswarm.sim.calibration import TargetWalk

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
    from gaitswarm.sim.calibration import QUANTITIES, Target

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
