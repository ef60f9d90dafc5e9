"""Tables of calibration targets."""

from __future__ import annotations

import csv
import json
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from gaitswarm.cli.inputs import read_design, read_json_object
from gaitswarm.services.optimizer.errors import InvalidRequest

if TYPE_CHECKING:
    from pydantic import BaseModel

_NEEDED: Final = ("walk", "controller", "design", "scenario", "quantity", "value", "tolerance")
_COLUMNS: Final = (*_NEEDED, "relative_to", "use")
_OF_WALK: Final = ("controller", "design", "scenario")

_LARGEST: Final = 1 << 20
"""Largest accepted table [B]."""


class _CellError(Exception):
    """A column, and the error in its cell."""


def read_targets(path: Path) -> dict[str, list[dict[str, Any]]]:
    """Read walks and targets of a spec of kind `calibration`; errors name line and column.

    path: a CSV file with a header; empty lines and lines that start with # are ignored. A walk's
        controller, design and scenario may be empty in its later rows. Files of designs and
        scenarios are relative to the table's folder.
    """
    try:
        with path.open(encoding="utf-8-sig", newline="") as file:
            text = file.read(_LARGEST + 1)
    except (OSError, UnicodeDecodeError) as error:
        raise InvalidRequest(f"cannot read {path}: {error}", field="targets") from error
    if len(text) > _LARGEST:
        raise InvalidRequest(f"{path} is larger than {_LARGEST >> 20} MiB", field="targets")
    reader = csv.reader(text.splitlines(), strict=True, skipinitialspace=True)
    try:
        targets = _targets(reader, path.parent)
    except csv.Error as error:
        raise InvalidRequest(f"{path}, line {reader.line_num}: {error}", field="targets") from error
    except _CellError as error:
        column, message = error.args
        raise InvalidRequest(
            f"{path}, line {reader.line_num}, column {column}: {message}", field="targets"
        ) from error
    if not targets["targets"]:
        raise InvalidRequest(f"{path} has no rows", field="targets")
    return targets


def _targets(reader: Iterable[list[str]], folder: Path) -> dict[str, list[dict[str, Any]]]:
    header: list[str] | None = None
    first: dict[str, dict[str, str]] = {}
    walks: dict[str, dict[str, Any]] = {}
    targets = []
    for entries in reader:
        cells = [entry.strip() for entry in entries]
        if not any(cells) or cells[0].startswith("#"):
            continue
        if header is None:
            header = cells
            _check_header(header)
            continue
        if len(cells) > len(header):
            raise _CellError(header[-1], "the line has more cells than the header")
        row = dict.fromkeys(_COLUMNS, "") | dict(zip(header, cells, strict=False))
        name = row["walk"]
        if name not in walks:
            walks[name] = _walk(row, folder)
            first[name] = row
        for column in _OF_WALK:
            if row[column] not in ("", first[name][column]):
                raise _CellError(column, f"differs from an earlier row of walk {name!r}")
        targets.append(_target(row, len(walks[name]["scenarios"])))
    return {"walks": list(walks.values()), "targets": targets}


def _check_header(columns: list[str]) -> None:
    for column in columns:
        if column not in _COLUMNS:
            raise _CellError(column, f"unknown column; known are {', '.join(_COLUMNS)}")
        if columns.count(column) > 1:
            raise _CellError(column, "duplicate column")
    for column in _NEEDED:
        if column not in columns:
            raise _CellError(column, "missing column")


def _walk(row: Mapping[str, str], folder: Path) -> dict[str, Any]:
    from gaitswarm.sim.calibration import TargetWalk

    for column in _OF_WALK:
        if not row[column]:
            raise _CellError(column, f"required in the first row of walk {row['walk']!r}")
    document = {
        "name": row["walk"],
        "controller": row["controller"],
        "design": _design(row["design"], row["controller"], folder),
        "scenarios": [_scenario(entry, folder) for entry in row["scenario"].split()],
    }
    return _checked(TargetWalk, document)


def _scenario(entry: str, folder: Path) -> str | dict[str, Any]:
    if not entry.endswith(".json"):
        return entry
    try:
        return read_json_object(folder / entry, "scenario")
    except InvalidRequest as error:
        raise _CellError("scenario", str(error).removeprefix("scenario: ")) from error


def _design(cell: str, controller: str, folder: Path) -> dict[str, Any]:
    try:
        if cell.startswith("{"):
            return dict(json.loads(cell))
        if not cell.startswith("published:"):
            cell = str(folder / cell)
        return read_design(cell, controller)
    except InvalidRequest as error:
        column = "controller" if error.field == "controller" else "design"
        raise _CellError(column, str(error).removeprefix("design: ")) from error
    except ValueError as error:
        raise _CellError("design", f"not JSON: {error}") from error


def _target(row: Mapping[str, str], scenarios: int) -> dict[str, Any]:
    """Return the target of a row; scenarios: number of those of its walk."""
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
            raise _CellError(column, f"{row[column]!r} is not a number") from error
    target = _checked(Target, document)
    if scenarios > 1 and not QUANTITIES[document["quantity"]].scenarios:
        raise _CellError("quantity", f"applies to one scenario, but the walk has {scenarios}")
    return target


def _checked(model: type[BaseModel], document: dict[str, Any]) -> dict[str, Any]:
    """Return a validated document as JSON values."""
    from pydantic import ValidationError

    from gaitswarm.sim.input import message_of, without_tags

    try:
        return model.model_validate(document).model_dump(mode="json")
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
        column = {"name": "walk", "scenarios": "scenario"}.get(field, field)
        raise _CellError(column, message) from error
