"""Tables keep their ids and numbers whole on a console of any width."""

from __future__ import annotations

import pytest

from gaitswarm.cli.output import print_table
from gaitswarm.cli.tables import table

ROWS = [
    ("wnb852gbnr7w", "first try on slopes", "succeeded", "18.1539"),
    ("pbnc75p8qd4s", "", "running", "-0.00441"),
]


@pytest.fixture
def lines(
    request: pytest.FixtureRequest,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> list[str]:
    """The table of jobs on a terminal of so many columns."""
    monkeypatch.setenv("COLUMNS", str(request.param))
    print_table(table(("id", "<name", "<state", "best fitness"), ROWS))
    return capsys.readouterr().out.splitlines()


@pytest.mark.parametrize("lines", [30, 40, 60, 80, 200], indirect=True)
def test_no_word_is_cut(lines: list[str]) -> None:
    words = " ".join(lines).split()
    assert {word for row in ROWS for cell in row for word in cell.split()} <= set(words)


@pytest.mark.parametrize("lines", [60, 80, 200], indirect=True)
def test_no_line_is_longer_than_the_console_where_the_words_fit(lines: list[str]) -> None:
    assert max(map(len, lines)) <= 60


@pytest.mark.parametrize("lines", [80], indirect=True)
def test_where_rows_fit_each_has_a_line_of_its_own(lines: list[str]) -> None:
    head, *rows = lines
    assert head.split() == ["id", "name", "state", "best", "fitness"]
    assert [row.split()[0] for row in rows] == ["wnb852gbnr7w", "pbnc75p8qd4s"]


def test_brackets_are_printed_as_they_are(capsys: pytest.CaptureFixture[str]) -> None:
    print_table(table(("variable", "<choices"), [("stride[front]", "[true, false]")]))
    out = capsys.readouterr().out
    assert "stride[front]" in out and "[true, false]" in out
