"""Pictures of boxes in rows with arrows between them, as SVG."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final
from xml.sax.saxutils import escape

Edge = tuple[str, str]

_WIDTH, _GAP_X, _GAP_Y, _MARGIN = 360, 60, 42, 16
_HEAD, _LINE = 32, 18
"""Height of a box without text, and of a line of text [px]."""

_LINE_COLOUR: Final = "#4a6b8a"


@dataclass(frozen=True)
class Box:
    """A box: a name above, lines of text below it, and what it is filled with."""

    label: str
    lines: Sequence[str]
    fill: str


@dataclass(frozen=True)
class Picture:
    """Boxes by name, in rows from the top. A row may have two at most."""

    title: str
    rows: Sequence[Sequence[str]]
    boxes: Mapping[str, Box]

    def drawn(self, arrows: Mapping[Edge, str], *, words: bool = False) -> str:
        """The picture as SVG.

        Args:
            arrows: What each says, by the boxes that it leads from and to.
            words: Whether the label is always shown, and not only under a pointer.

        Raises:
            ValueError: An arrow leads upwards.
        """
        width = 2 * _MARGIN + 2 * _WIDTH + _GAP_X
        height = 2 * _MARGIN + len(self.rows) * self._height + (len(self.rows) - 1) * _GAP_Y
        corners = {
            name: (_left(len(row), column, width), _MARGIN + k * (self._height + _GAP_Y))
            for k, row in enumerate(self.rows)
            for column, name in enumerate(row)
        }
        parts = [
            (
                f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" role="img"'
                f' aria-label="{escape(self.title)}" font-family="sans-serif">'
            ),
            (
                '<defs><marker id="tip" viewBox="0 0 8 8" refX="7" refY="4" markerWidth="8"'
                f' markerHeight="8" orient="auto"><path d="M0 0 8 4 0 8z" fill="{_LINE_COLOUR}"/>'
                "</marker></defs>"
            ),
            f'<rect width="{width}" height="{height}" rx="8" fill="#ffffff"/>',
        ]
        for (a, b), says in sorted(arrows.items()):
            parts += self._arrow(corners[a], corners[b], f"{a} {says} {b}", says if words else "")
        parts += [self._box(self.boxes[name], *corners[name]) for row in self.rows for name in row]
        return "\n".join([*parts, "</svg>", ""])

    @property
    def _height(self) -> int:
        return _HEAD + _LINE * max(len(box.lines) for box in self.boxes.values())

    def _arrow(
        self, start: tuple[int, int], end: tuple[int, int], title: str, word: str
    ) -> list[str]:
        """From a box's lower edge to the upper edge of another, past the boxes between them."""
        (x1, y1), (x2, y2) = start, end
        if y1 > y2:
            raise ValueError(f"{title}, which leads upwards")
        if y1 == y2:
            side = 1 if x2 > x1 else -1
            ends = [
                x + (_WIDTH if (side > 0) == first else 0) for x, first in ((x1, True), (x2, False))
            ]
            path = f"M{ends[0]} {y1 + self._height // 2}H{ends[1]}"
            anchor = "start"
            place = (min(ends) + 6, y1 + self._height // 2 - 6)
        else:
            # Where an arrow passes a row, it bends away from the box in the middle.
            passes = y2 - y1 > self._height + _GAP_Y
            aside = (1 if x2 >= x1 else -1) * _WIDTH // 3 if passes else 0
            a, b = x1 + _WIDTH // 2 + aside, x2 + _WIDTH // 2 + aside
            top, bottom = y1 + self._height, y2
            middle = (top + bottom) // 2
            path = f"M{a} {top}C{a} {middle} {b} {middle} {b} {bottom}"
            # On the side that the arrow does not bend to.
            place, anchor = ((a - 6, top + 17), "end") if b > a else ((a + 6, top + 17), "start")
        line = (
            f'<path d="{path}" fill="none" stroke="{_LINE_COLOUR}" stroke-width="1.5"'
            f' marker-end="url(#tip)"><title>{escape(title)}</title></path>'
        )
        if not word:
            return [line]
        return [
            line,
            (
                f'<text x="{place[0]}" y="{place[1]}" font-size="11" fill="#33475b"'
                f' text-anchor="{anchor}">{escape(word)}</text>'
            ),
        ]

    def _box(self, box: Box, x: int, y: int) -> str:
        middle = x + _WIDTH // 2
        lines = [
            f'<text x="{middle}" y="{y + 38 + k * _LINE}" text-anchor="middle" font-size="11"'
            f' fill="#33475b">{escape(line)}</text>'
            for k, line in enumerate(box.lines)
        ]
        return (
            f'<g><rect x="{x}" y="{y}" width="{_WIDTH}" height="{self._height}" rx="6"'
            f' fill="{box.fill}" stroke="{_LINE_COLOUR}"/>'
            f'<text x="{middle}" y="{y + 20}" text-anchor="middle" font-size="14"'
            f' font-weight="bold" fill="#1c2b3a">{escape(box.label)}</text>{"".join(lines)}</g>'
        )


def _left(count: int, column: int, width: int) -> int:
    occupied = count * _WIDTH + (count - 1) * _GAP_X
    return (width - occupied) // 2 + column * (_WIDTH + _GAP_X)
