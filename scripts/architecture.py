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
from xml.sax.saxutils import escape

import grimp

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

_WIDTH, _HEIGHT, _GAP_X, _GAP_Y, _MARGIN = 360, 50, 60, 42, 16

_LONGEST: Final = 64
"""Characters of a sentence that a box has room for."""

Edge = tuple[str, str]


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
    width = 2 * _MARGIN + 2 * _WIDTH + _GAP_X
    height = 2 * _MARGIN + len(ROWS) * _HEIGHT + (len(ROWS) - 1) * _GAP_Y
    corners = {
        room: (_left(len(row), column, width), _MARGIN + k * (_HEIGHT + _GAP_Y))
        for k, row in enumerate(ROWS)
        for column, room in enumerate(row)
    }
    parts = [
        (
            f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" role="img"'
            ' aria-label="Rooms of the code and their imports" font-family="sans-serif">'
        ),
        (
            '<defs><marker id="tip" viewBox="0 0 8 8" refX="7" refY="4" markerWidth="8"'
            ' markerHeight="8" orient="auto"><path d="M0 0 8 4 0 8z" fill="#4a6b8a"/></marker>'
            "</defs>"
        ),
        f'<rect width="{width}" height="{height}" rx="8" fill="#ffffff"/>',
    ]
    parts += [_arrow(corners[a], corners[b], f"{a} imports {b}") for a, b in sorted(arrows)]
    parts += [_box(room, *corners[room], sentences[room]) for row in ROWS for room in row]
    return "\n".join([*parts, "</svg>", ""])


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


def _left(count: int, column: int, width: int) -> int:
    occupied = count * _WIDTH + (count - 1) * _GAP_X
    return (width - occupied) // 2 + column * (_WIDTH + _GAP_X)


def _arrow(start: tuple[int, int], end: tuple[int, int], title: str) -> str:
    """From the lower edge of a box to the upper edge of another, past the boxes between them."""
    (x1, y1), (x2, y2) = start, end
    if y1 > y2:
        raise ValueError(f"{title}, which leads upwards")
    if y1 == y2:
        side = 1 if x2 > x1 else -1
        ends = [
            x + (_WIDTH if (side > 0) == first else 0) for x, first in ((x1, True), (x2, False))
        ]
        path = f"M{ends[0]} {y1 + _HEIGHT // 2}H{ends[1]}"
    else:
        # Where an arrow passes a row, it bends away from the box in the middle.
        aside = 0 if y2 - y1 <= _HEIGHT + _GAP_Y else (1 if x2 >= x1 else -1) * _WIDTH // 3
        a, b = x1 + _WIDTH // 2 + aside, x2 + _WIDTH // 2 + aside
        top, bottom = y1 + _HEIGHT, y2
        middle = (top + bottom) // 2
        path = f"M{a} {top}C{a} {middle} {b} {middle} {b} {bottom}"
    return (
        f'<path d="{path}" fill="none" stroke="#4a6b8a" stroke-width="1.5"'
        f' marker-end="url(#tip)"><title>{title}</title></path>'
    )


def _box(room: str, x: int, y: int, text: str) -> str:
    middle = x + _WIDTH // 2
    name = room.removeprefix("services.optimizer.") if ".optimizer." in room else room
    inside = "#e8f0f8" if room.startswith("services") else "#f3efe4"
    label = name if name == room else f"services.optimizer / {name}"
    return (
        f'<g><rect x="{x}" y="{y}" width="{_WIDTH}" height="{_HEIGHT}" rx="6" fill="{inside}"'
        ' stroke="#4a6b8a"/>'
        f'<text x="{middle}" y="{y + 20}" text-anchor="middle" font-size="14" font-weight="bold"'
        f' fill="#1c2b3a">{escape(label)}</text>'
        f'<text x="{middle}" y="{y + 38}" text-anchor="middle" font-size="11" fill="#33475b">'
        f"{escape(text)}</text></g>"
    )


def main() -> int:
    """Write the picture."""
    rooms = [room for row in ROWS for room in row]
    PICTURE.write_text(drawn(edges(), {room: sentence(room) for room in rooms}), encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
