"""Draw docs/images/architecture.svg from the imports of the code: python -m scripts.architecture

A box is a room: a package, or a module that stands by itself; its sentence is the first line of
its docstring. An arrow is an import. One that follows from others is left out: with a -> b -> c
there is no arrow a -> c.
"""

from __future__ import annotations

import ast
import sys
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Final

import grimp

from scripts.boxes import Box, Edge, Picture

ROOT: Final = Path(__file__).parents[1]

PICTURE: Final = ROOT / "docs" / "images" / "architecture.svg"

ROWS: Final = (
    ("cli", "api"),
    ("gaitswarm",),
    ("services.runtime",),
    ("services.monitoring",),
    ("services.worker", "services.optimizer.service"),
    ("services.optimizer.run", "services.optimizer.analysis"),
    ("services.optimizer.store",),
    ("services.optimizer.jobs",),
    ("services.optimizer.tournament",),
    ("services.optimizer.search", "sim"),
)
"""Where a room is drawn, from the top. Every arrow must lead downwards or along its row."""

_LONGEST: Final = 64
"""Characters of a sentence that a box has room for."""


def edges() -> frozenset[Edge]:
    """Imports between rooms, those that follow from others left out."""
    rooms = [room for row in ROWS for room in row]
    graph = grimp.build_graph(*sorted({room.partition(".")[0] for room in rooms}), cache_dir=None)
    found = {
        (importer, imported)
        for module in graph.modules
        for other in graph.find_modules_directly_imported_by(module)
        if (importer := _room_of(module, rooms)) is not None
        and (imported := _room_of(other, rooms)) is not None
        and importer != imported
    }
    # A neighbour in the row is a special case, as the server is for the terminal's `serve`.
    below = {(a, b) for a, b in found if _row(a) != _row(b)}
    reduced = {(a, b) for a, b in below if not _reaches(below - {(a, b)}, a, b)}
    return frozenset(reduced | (found - below))


def sentence(room: str) -> str:
    """First line of the room's docstring. Raises ValueError if it has none, or too long a one."""
    path = ROOT / room.replace(".", "/")
    file = path / "__init__.py" if path.is_dir() else path.with_suffix(".py")
    text = ast.get_docstring(ast.parse(file.read_text(encoding="utf-8")))
    if not text:
        raise ValueError(f"{file.relative_to(ROOT)} has no docstring to draw")
    line = text.partition("\n")[0].rstrip(".")
    if len(line) > _LONGEST:
        raise ValueError(f"{file.relative_to(ROOT)}: {line!r} does not fit into its box")
    return line


def drawn(arrows: Iterable[Edge], sentences: Mapping[str, str]) -> str:
    """The picture as SVG. Raises ValueError for an arrow that leads upwards."""
    boxes = {room: _box(room, text) for room, text in sentences.items()}
    picture = Picture("Rooms of the code and their imports", ROWS, boxes)
    return picture.drawn(dict.fromkeys(arrows, "imports"))


def _room_of(module: str, rooms: Iterable[str]) -> str | None:
    return next((r for r in rooms if module == r or module.startswith(f"{r}.")), None)


def _row(room: str) -> int:
    return next(k for k, row in enumerate(ROWS) if room in row)


def _reaches(arrows: Iterable[Edge], start: str, end: str) -> bool:
    arrows = list(arrows)
    seen, waiting = {start}, [start]
    while waiting:
        here = waiting.pop()
        following = {b for a, b in arrows if a == here} - seen
        seen |= following
        waiting += following
    return end in seen


def _box(room: str, text: str) -> Box:
    name = room.removeprefix("services.optimizer.")
    label = room if name == room else f"services.optimizer / {name}"
    return Box(label, [text], "#e8f0f8" if room.startswith("services") else "#f3efe4")


def main() -> int:
    """Write the picture."""
    rooms = [room for row in ROWS for room in row]
    PICTURE.write_text(drawn(edges(), {room: sentence(room) for room in rooms}), encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
