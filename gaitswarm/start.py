"""Start designs of a search: from earlier jobs, or from a CSV file."""

from __future__ import annotations

import csv
import math
import os
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from gaitswarm.services.optimizer.errors import InvalidRequest

_DESIGN: Final = "design."
"""Prefix of variables in a table of evaluations."""

_FITNESS: Final = "fitness"

_PLACE: Final = re.compile(r"start\.(\d+)(?:\.(\w+))?")

Design = dict[str, float | str]

Document = dict[str, Any]
"""As JSON has it."""


@dataclass(frozen=True, slots=True)
class Row:
    """A design of a file.

    Attributes:
        line: Where it ends in the file, from 1.
        fitness: Fitness in the file, minimized; None if there is none.
        design: Values by name.
    """

    line: int
    fitness: float | None
    design: Design


@dataclass(frozen=True, slots=True)
class StartFile:
    """Designs of a CSV file, in the order in which a search is to begin with them.

    Attributes:
        path: The file.
        rows: At least one.
    """

    path: Path
    rows: tuple[Row, ...]

    @property
    def designs(self) -> tuple[Design, ...]:
        """The designs, as the `start` of a spec has them."""
        return tuple(row.design for row in self.rows)

    def located(self, error: InvalidRequest) -> InvalidRequest:
        """Add the place in the file to an error."""
        place = _PLACE.fullmatch(error.field)
        if place is None:
            return error
        index, column = int(place[1]), place[2]
        where = f"{self.path}, line {self.rows[index].line}"
        where += f", column {column}" if column else ""
        message = str(error).removeprefix(f"{error.field}: ")
        return InvalidRequest(f"{where}: {message}", field="start")


def start_from(source: str | os.PathLike[str], count: int | None = None) -> StartFile | Document:
    """Start designs from a file or from identifiers of jobs."""
    if count is not None and count < 1:
        raise InvalidRequest("must be at least 1", field="start_count")
    if Path(source).suffix.lower() == ".csv":
        return read_designs(Path(source), count)
    if Path(source).is_file():
        raise InvalidRequest(
            f"{os.fspath(source)} is a file, of which only CSV is read: its name must end in .csv",
            field="start",
        )
    ids = [entry.strip() for entry in str(source).split(",") if entry.strip()]
    return {"jobs": ids} if count is None else {"jobs": ids, "count": count}


def read_designs(path: Path, count: int | None = None) -> StartFile:
    """Read designs from a CSV file: one row a design, one column a variable.

    A file of `gaitswarm export` works: its columns that begin with `design.` are the
    variables. Rows without a fitness, where there is such a column, have failed and are left out.
    """
    try:
        with path.open(encoding="utf-8-sig", newline="") as file:
            rows = list(_rows(csv.DictReader(file, strict=True)))
    except OSError as error:
        raise InvalidRequest(f"cannot read {path}: {error.strerror}", field="start") from error
    except (csv.Error, UnicodeDecodeError) as error:
        raise InvalidRequest(f"{path} is not a CSV file: {error}", field="start") from error
    rows.sort(key=lambda row: -math.inf if row.fitness is None else row.fitness)
    different: dict[tuple[Any, ...], Row] = {}
    for row in rows:
        different.setdefault(tuple(row.design.items()), row)
    if not different:
        raise InvalidRequest(
            f"{path} has no designs; its first line names variables, and every other line is a"
            " design",
            field="start",
        )
    return StartFile(path, tuple(different.values())[:count])


def _rows(reader: csv.DictReader[str]) -> Iterator[Row]:
    names = list(reader.fieldnames or ())
    exported = any(name.startswith(_DESIGN) for name in names)
    for cells in reader:
        if None in cells:
            raise csv.Error(f"line {reader.line_num} has more cells than the first line has names")
        design: Design = {}
        for name in names:
            text = (cells[name] or "").strip()
            if text and name != _FITNESS and name.startswith(_DESIGN if exported else ""):
                design[name.removeprefix(_DESIGN)] = _value(text)
        fitness = _value((cells.get(_FITNESS) or "nan").strip()) if _FITNESS in names else None
        if fitness is None:
            yield Row(reader.line_num, None, design)
        elif isinstance(fitness, float) and math.isfinite(fitness):
            yield Row(reader.line_num, fitness, design)


def _value(text: str) -> float | str:
    try:
        return float(text)
    except ValueError:
        return text
