"""A table that never cuts a word: where it is too wide, its rows are stacked."""

from __future__ import annotations

from collections.abc import Iterator

from rich.console import Console, ConsoleOptions, RenderableType, RenderResult
from rich.measure import Measurement
from rich.table import Column
from rich.table import Table as RichTable
from rich.text import Text


class Table(RichTable):
    """As Rich's, but ids and numbers stay whole on a console of any width.

    Cells break between words only. Where even so a row does not fit on a line, every row becomes a
    block of lines, each with a heading and a cell; empty cells have none. A first cell without a
    heading, or with nothing beside it, is the heading of its block or of those below. Of a table
    without headings every row is a line that the terminal breaks. Brackets in a cell are no markup.
    """

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        """The table, or its rows as blocks. Called by Rich."""
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
        """Characters that the table takes when all columns are as narrow as their words."""
        _, right, _, left = self.padding
        edges = 0 if self.pad_edge else left + right
        return sum((c.min_width or 0) + left + right for c in self.columns) - edges

    def _blocks(self) -> Iterator[Text | RichTable]:
        """One block a row, with an empty line between two."""
        if self.title:
            yield Text(str(self.title), style="italic")
        for number, row in enumerate(self._rows()):
            if number:
                yield Text()
            said = [pair for pair in zip(self.columns, row, strict=True) if str(pair[1])]
            if said and (len(said) == 1 or not str(said[0][0].header)):
                yield Text(str(said.pop(0)[1]), style="bold")
            block = RichTable(box=None, show_header=False, padding=(0, 2, 0, 0))
            block.add_column(overflow="fold", no_wrap=True)
            block.add_column(overflow="fold")
            for column, cell in said:
                block.add_row(_on_one_line(column.header), _text(cell))
            if said:
                yield block

    def _lines(self) -> Iterator[Text]:
        """One line a row, cells below each other but for the last."""
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
    """Of a column's heading and cells; a cell that must not be wrapped is one word."""
    head = Measurement.get(console, options, column.header).minimum
    cells = [Measurement.get(console, options, cell) for cell in column.cells]
    return max([head, *(cell.maximum if column.no_wrap else cell.minimum for cell in cells)])


def _on_one_line(heading: RenderableType) -> RenderableType:
    return Text(" ".join(str(heading).split())) if isinstance(heading, str | Text) else heading
