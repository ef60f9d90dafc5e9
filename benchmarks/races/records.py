"""Runs of races in CSV files, one line each: read, looked up, appended."""

from __future__ import annotations

import csv
import hashlib
import io
import math
import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from benchmarks.races.plans import CHECKPOINTS

FOLDER: Final = Path(__file__).parents[2] / "docs" / "data" / "races"
"""Where the runs are kept that the documents speak of."""

EARLIER: Final = FOLDER.parent / "races-medians.csv"
"""Medians of races on the robot whose single runs were not kept."""

_RUN: Final = ("problem", "method", "settings", "evaluations", "repetition", "seed")
_BEST: Final = tuple(f"best_{count}" for count in CHECKPOINTS)
_COUNTS: Final = ("to_best", "to_target")
_PROVENANCE: Final = ("cpu_s", "search", "simulator", "libraries")

HEADER: Final = (*_RUN, *_BEST, *_COUNTS, *_PROVENANCE)
"""Columns of a file."""

Key = tuple[str, str, str, int, int]
"""(problem, method, digest of its settings, budget, seed): what a run is recorded under."""


class BadRecord(ValueError):
    """A file of runs cannot be read; says where and why."""


@dataclass(frozen=True, slots=True)
class Record:
    """A run.

    Attributes:
        problem: Its name.
        method: Its name.
        settings: Digest of the method's settings.
        evaluations: Budget.
        repetition: From 0.
        seed: Of the run.
        best: Least fitness after each of `CHECKPOINTS`, judged in double precision; NaN beyond the
            budget, or while all evaluations failed.
        to_best: Evaluations until the best was found; NaN without one.
        to_target: Evaluations until the target was reached; NaN if it was not.
        cpu_s: Processor time [s].
        search: Digest of the code of search and judgement.
        simulator: Digest of the simulator's code, the robot and the backend.
        libraries: With their versions.
    """

    problem: str
    method: str
    settings: str
    evaluations: int
    repetition: int
    seed: int
    best: tuple[float, ...]
    to_best: float
    to_target: float
    cpu_s: float
    search: str
    simulator: str
    libraries: str

    @property
    def key(self) -> Key:
        """What the run is recorded under."""
        return (self.problem, self.method, self.settings, self.evaluations, self.seed)

    def row(self) -> tuple[object, ...]:
        """As of `HEADER`; values to nine digits, nothing for what there is not."""
        return (
            *(getattr(self, name) for name in _RUN),
            *(_text(value) for value in self.best),
            *(_text(getattr(self, name)) for name in _COUNTS),
            f"{self.cpu_s:.1f}",
            *(getattr(self, name) for name in _PROVENANCE[1:]),
        )


def digest(text: str) -> str:
    """Ten digits that stand for a text."""
    return hashlib.sha256(text.encode()).hexdigest()[:10]


def read(path: Path) -> list[Record]:
    """Runs of a file; none if there is no file.

    Raises:
        BadRecord: It has another header, or a line that is none of a run.
    """
    if not path.exists():
        return []
    with path.open(newline="", encoding="utf-8") as file:
        rows = list(csv.reader(file))
    if not rows or tuple(rows[0]) != HEADER:
        raise BadRecord(f"{path}: the header must be {','.join(HEADER)}")
    return [_record(path, line, row) for line, row in enumerate(rows[1:], start=2)]


def read_all(folder: Path = FOLDER) -> list[Record]:
    """Runs of all files of a folder."""
    return [record for path in sorted(folder.glob("*.csv")) for record in read(path)]


def append(path: Path, record: Record) -> None:
    """Add a run to a file at once, so that a run that is stopped leaves whole lines."""
    rows: list[Sequence[object]] = [] if path.exists() else [HEADER]
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows([*rows, record.row()])
    path.parent.mkdir(parents=True, exist_ok=True)
    descriptor = os.open(path, os.O_WRONLY | os.O_APPEND | os.O_CREAT, 0o644)
    try:
        os.write(descriptor, text.getvalue().encode())
    finally:
        os.close(descriptor)


def _record(path: Path, line: int, row: list[str]) -> Record:
    try:
        values = dict(zip(HEADER, row, strict=True))
        return Record(
            problem=values["problem"],
            method=values["method"],
            settings=values["settings"],
            evaluations=int(values["evaluations"]),
            repetition=int(values["repetition"]),
            seed=int(values["seed"]),
            best=tuple(_number(values[name]) for name in _BEST),
            to_best=_number(values["to_best"]),
            to_target=_number(values["to_target"]),
            cpu_s=float(values["cpu_s"]),
            search=values["search"],
            simulator=values["simulator"],
            libraries=values["libraries"],
        )
    except ValueError as error:
        raise BadRecord(f"{path}, line {line}: {error}") from error


def _text(value: float) -> str:
    return "" if math.isnan(value) else f"{value:.9g}"


def _number(text: str) -> float:
    return float(text) if text else math.nan
