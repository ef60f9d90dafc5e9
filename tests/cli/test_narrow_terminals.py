"""Output on narrow terminals: no name, id or number is cut."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.cli.conftest import Gaitswarm
from tests.examples.commands import run_command

pytestmark = pytest.mark.slow

COMMANDS = [
    "list",
    "status ID",
    "best ID",
    "verdict ID",
    "history ID",
    "importance ID",
    "front ID",
    "rank ID --preference A",
    "preferences ID --for 0.0",
    "diff JOBS",
    "simulate --design published:A --scenario 1",
    "gaits",
    "optimizers",
]


@pytest.fixture(scope="module")
def jobs(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, list[str]]:
    """A database, and the ids of four jobs in it; the first has designs enough for all questions.

    Its variables have long names, and it has two scenarios.
    """
    db = tmp_path_factory.mktemp("narrow") / "jobs.db"
    budget = "--optimizer random --particles 6 --iterations 2 --evaluator in-process"
    searched = "--controller pi --with-gait --scenarios 1,3 --preference chapter-3"
    first = run_command("optimize", *f"{searched} {budget}".split(), "--json", "--db", db)
    assert first.code == 0, first.err
    others = [
        run_command("submit", *options.split(), "--db", db).out.strip()
        for options in ("--optimizer pso", "--controller pid", "--preference B --scenarios 1")
    ]
    return db, [first.json["id"], *others]


@pytest.mark.variants("list", "status ID", "history ID", "optimizers")
@pytest.mark.parametrize("command", COMMANDS)
def test_narrow_terminals_show_the_same_words_as_wide_ones(
    gaitswarm: Gaitswarm,
    jobs: tuple[Path, list[str]],
    command: str,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    db, ids = jobs
    words = command.replace("ID", ids[0]).replace("JOBS", " ".join(ids)).split()
    where = () if words[0] in ("gaits", "optimizers") else ("--db", db)

    def said(columns: int) -> str:
        monkeypatch.setenv("COLUMNS", str(columns))
        result = gaitswarm(*words, *where)
        assert result.code == 0, result.err
        return result.out

    whole = set(said(400).split())
    for columns in (60, 80):
        out = said(columns)
        assert whole - set(out.split()) == set(), out
        assert "…" not in out
