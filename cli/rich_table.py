"""Tables that fit every terminal."""

from __future__ import annotations

from collections.abc import Iterator

from rich.console import Console, ConsoleOptions, RenderableType, RenderResult
from rich.measure import Measurement
from rich.table import Column
from rich.table import Table as RichTable
from rich.text import Text


class Table(RichTable):
    """Rich table that never cuts ids and numbers, at any console width.

    Cells break only between words. If rows still do not fit, every row becomes a block of lines
    with a heading and a cell each, without empty cells. A first cell without a heading, or alone
    in its row, is the heading of its block or of the following ones. Rows of tables without
    headings become lines that the terminal wraps. Brackets in cells are not markup.
    """

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        """Render the table, or its rows as blocks; called by Rich."""
        options = options.update(markup=False)
        for column in self.columns:
            column.min_width = _longest_word(console, options, column)
        if self._narrowest() <= options.max_width:
            yield from super().__rich_console__(console, options)
        elif self.show_header:
            yield from self._blocks()
        else:
            yield from self._lines()

    def _narrowest(self) -> int:
        """Return the width with all columns as narrow as their longest words."""
        _, right, _, left = self.padding
        edges = 0 if self.pad_edge else left + right
        return sum((c.min_width or 0) + left + right for c in self.columns) - edges

    def _blocks(self) -> Iterator[Text | RichTable]:
        """Yield one block per row, separated by empty lines."""
        if self.title:
            yield Text(str(self.title), style="italic")
        for number, row in enumerate(self._rows()):
            if number:
                yield Text()
            cells = [pair for pair in zip(self.columns, row, strict=True) if str(pair[1])]
            if cells and (len(cells) == 1 or not str(cells[0][0].header)):
                yield Text(str(cells.pop(0)[1]), style="bold")
            block = RichTable(box=None, show_header=False, padding=(0, 2, 0, 0))
            block.add_column(overflow="fold", no_wrap=True)
            block.add_column(overflow="fold")
            for column, cell in cells:
                block.add_row(_on_one_line(column.header), _text(cell))
            if cells:
                yield block

    def _lines(self) -> Iterator[Text]:
        """Yield one line per row, with aligned cells except the last."""
        rows = [[_text(cell) for cell in row] for row in self._rows()]
        widths = [max(cell.cell_len for cell in column) for column in zip(*rows, strict=True)]
        for row in rows:
            for cell, width in zip(row[:-1], widths, strict=False):
                cell.pad_right(width - cell.cell_len + 2)
            yield Text(" ").join([Text(), Text.assemble(*row)])

    def _rows(self) -> list[tuple[RenderableType, ...]]:
        return list(zip(*(column.cells for column in self.columns), strict=True))


def _text(cell: RenderableType) -> Text:
    return cell.copy() if isinstance(cell, Text) else Text(str(cell))


def _longest_word(console: Console, options: ConsoleOptions, column: Column) -> int:
    """Return the longest word of a column; cells that must not wrap are one word."""
    head = Measurement.get(console, options, column.header).minimum
    cells = [Measurement.get(console, options, cell) for cell in column.cells]
    return max([head, *(cell.maximum if column.no_wrap else cell.minimum for cell in cells)])


def _on_one_line(heading: RenderableType) -> RenderableType:
    return Text(" ".join(str(heading).split())) if isinstance(heading, str | Text) else heading
