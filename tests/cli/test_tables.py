"""Tables keep their ids and numbers whole on a console of any width."""

from __future__ import annotations

import io

import pytest
from rich.console import Console

from gaitswarm.cli.rich_table import Table

ROWS = [
    ("wnb852gbnr7w", "first try on slopes", "succeeded", "18.1539"),
    ("pbnc75p8qd4s", "", "running", "-0.00441"),
]


def printed(table: Table, width: int) -> str:
    out = io.StringIO()
    Console(file=out, width=width).print(table)
    return out.getvalue()


def jobs() -> Table:
    table = Table("id", "name", "state", "best fitness", box=None)
    for row in ROWS:
        table.add_row(*row)
    return table


@pytest.mark.parametrize("width", [30, 40, 60, 80, 200])
def test_no_word_is_cut(width: int) -> None:
    words = printed(jobs(), width).split()
    assert {word for row in ROWS for cell in row for word in cell.split()} <= set(words)


@pytest.mark.parametrize("width", [30, 40, 60, 80, 200])
def test_no_line_is_longer_than_the_console(width: int) -> None:
    assert max(map(len, printed(jobs(), width).splitlines())) <= width


def test_where_rows_fit_each_has_a_line_of_its_own() -> None:
    head, *rows = printed(jobs(), 80).splitlines()
    assert head.split() == ["id", "name", "state", "best", "fitness"]
    assert [row.split()[0] for row in rows] == ["wnb852gbnr7w", "pbnc75p8qd4s"]


def test_where_they_do_not_each_is_a_block_of_headings_and_cells() -> None:
    blocks = printed(jobs(), 36).split("\n\n")
    assert [line.split(maxsplit=1)[0] for line in blocks[0].splitlines()] == [
        "id", "name", "state", "best",
    ]  # fmt: skip
    assert "best fitness  18.1539" in blocks[0]
    assert "pbnc75p8qd4s" in blocks[1]


@pytest.mark.parametrize("width", [20, 30, 40, 60])
def test_a_cell_that_must_not_be_wrapped_is_not_cut_either(width: int) -> None:
    table = Table(box=None)
    for head in ("variable", "moved with", "interval"):
        table.add_column(head, no_wrap=True)
    table.add_row("duty_factor", "cycle_time, -0.63", "51 (40 to 65)")
    text = " ".join(printed(table, width).split())
    if width > 40:
        assert "duty_factor cycle_time, -0.63 51 (40 to 65)" in text
    assert "…" not in text and "40 to 65" in text


def test_a_first_cell_without_a_heading_is_that_of_its_block() -> None:
    table = Table("", "wnb852gbnr7w", "pbnc75p8qd4s", box=None)
    table.add_row("state", "done", "running")
    assert [line.split() for line in printed(table, 24).splitlines()] == [
        ["state"], ["wnb852gbnr7w", "done"], ["pbnc75p8qd4s", "running"],
    ]  # fmt: skip


def test_a_table_without_headings_is_lines_of_which_none_is_broken() -> None:
    table = Table(box=None, show_header=False)
    table.add_row("evaluations", "24 of 24")
    table.add_row("head", "26cc517422d1dddf1b6253378bc252c04665d0b6")
    out = io.StringIO()
    Console(file=out, width=40, soft_wrap=True).print(table)
    assert out.getvalue().splitlines() == [
        " evaluations  24 of 24",
        " head         26cc517422d1dddf1b6253378bc252c04665d0b6",
    ]


@pytest.mark.parametrize("width", [24, 80])
def test_brackets_are_printed_as_they_are(width: int) -> None:
    table = Table("variable", "choices", box=None)
    table.add_row("stride[front]", "[true, false]")
    assert "stride[front]" in printed(table, width)
    assert "[true, false]" in " ".join(printed(table, width).split())


def test_a_block_has_no_lines_for_cells_without_a_word() -> None:
    table = Table("drive", "status", "speed", box=None)
    table.add_row("normal-fast")
    table.add_row("2016", "ok", "0.152")
    blocks = printed(table, 20).split("\n\n")
    assert blocks[0].strip() == "normal-fast"
    assert len(blocks[1].splitlines()) == 3
