"""Importance of variables: all four clients and the command."""

from __future__ import annotations

import pytest

import gaitswarm
from tests.examples.commands import run_command
from tests.library.conftest import Finished, Reach

pytestmark = pytest.mark.slow


def test_it_is_the_same_from_everywhere(reach: Reach, finished: Finished) -> None:
    view = reach(finished.db).importance(finished.id)
    assert [variable.name for variable in view.variables] == ["P", "I"]
    assert (view.designs + view.failed, view.sampled) == (6, 6)
    with gaitswarm.open(finished.db) as here:
        assert here.importance(finished.id) == view


def test_what_makes_no_sense_is_refused(reach: Reach, finished: Finished) -> None:
    jobs = reach(finished.db)
    with pytest.raises(gaitswarm.NotFound):
        jobs.importance("nowhere")
    queued = jobs.submit(finished.result.job.spec)
    with pytest.raises(gaitswarm.Conflict, match="no design yet"):
        jobs.importance(queued.id)


def test_the_terminal_shows_a_row_for_every_variable(finished: Finished) -> None:
    result = run_command("importance", finished.id, "--db", finished.db)
    assert result.code == 0, result.err
    rows = [line.split()[0] for line in result.out.splitlines() if line.strip()]
    assert {"variable", "P", "I"} <= set(rows)
    said = " ".join(result.out.split())
    assert "of all 6 failed" in said
    assert "indices need 20 designs that succeed in every case" in said
    document = run_command("importance", finished.id, "--db", finished.db, "--json").json
    assert [variable["name"] for variable in document["variables"]] == ["P", "I"]
