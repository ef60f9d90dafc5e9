"""Commands about jobs do the same on a database and over HTTP."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from gaitswarm.services.optimizer.store import open_store
from tests.cli.conftest import Finished, Gaitswarm

pytestmark = pytest.mark.slow

Place = Callable[[Path], list[str]]


@pytest.fixture
def queued(gaitswarm: Gaitswarm, small_spec: Path, db: Path) -> str:
    result = gaitswarm("submit", "--spec", small_spec, "--db", db)
    assert result.code == 0, result.err
    return result.out.strip()


def test_submit_queues_a_job_that_status_and_list_then_show(
    gaitswarm: Gaitswarm, small_spec: Path, db: Path, place: Place, queued: str
) -> None:
    where = place(db)
    submitted = gaitswarm("submit", "--spec", small_spec, "--seed", "8", *where, "--json").json
    assert submitted["state"] == "queued"
    assert submitted["spec"]["seed"] == 8
    status = gaitswarm("status", submitted["id"], *where, "--json").json
    assert status == submitted
    listed = gaitswarm("list", *where, "--json").json
    assert [job["id"] for job in listed] == [submitted["id"], queued]
    assert gaitswarm("list", "--limit", "1", *where, "--json").json == listed[:1]
    assert gaitswarm("list", "--state", "paused", *where, "--json").json == []


def test_an_idempotency_key_creates_one_job_and_conflicts_with_another_spec(
    gaitswarm: Gaitswarm, small_spec: Path, db: Path, queued: str, place: Place
) -> None:
    where = place(db)
    submit = ("submit", "--spec", small_spec, "--idempotency-key", "k", *where)
    first, second = gaitswarm(*submit), gaitswarm(*submit)
    assert first.out == second.out != f"{queued}\n"
    other = gaitswarm(*submit, "--iterations", "9")
    assert other.code == 4
    assert "idempotency" in other.err


def test_pause_resume_and_cancel_change_the_state_until_the_job_has_ended(
    gaitswarm: Gaitswarm, db: Path, place: Place, queued: str
) -> None:
    where = place(db)
    assert gaitswarm("pause", queued, *where, "--json").json["state"] == "paused"
    again = gaitswarm("pause", queued, *where)
    assert again.code == 4
    assert "cannot pause a job that is paused" in again.err
    assert gaitswarm("resume", queued, *where).out == f"job {queued} is queued\n"
    assert gaitswarm("cancel", queued, *where, "--json").json["state"] == "cancelled"
    assert gaitswarm("resume", queued, *where).code == 4


@pytest.mark.parametrize(
    "command", ["status", "watch", "history", "best", "pause", "resume", "cancel", "export"]
)
def test_an_unknown_job_is_exit_code_3(
    gaitswarm: Gaitswarm, finished: Finished, place: Place, command: str, tmp_path: Path
) -> None:
    output = ["--output", tmp_path / "x.csv"] if command == "export" else []
    result = gaitswarm(command, "nosuchjob", *output, *place(finished.db))
    assert result.code == 3
    assert "nosuchjob" in result.err
    assert result.out == ""
    assert list(tmp_path.glob("*.csv")) == []


def test_best_of_a_job_without_any_is_exit_code_3(
    gaitswarm: Gaitswarm, db: Path, place: Place, queued: str
) -> None:
    result = gaitswarm("best", queued, *place(db), "--json")
    assert result.code == 3
    assert "design yet" in result.err


def test_best_equals_the_report_of_optimize(
    gaitswarm: Gaitswarm, finished: Finished, place: Place
) -> None:
    where = place(finished.db)
    assert gaitswarm("best", finished.id, *where, "--json").json == finished.job["best"]
    text = gaitswarm("best", finished.id, *where).out
    assert "FI1R" in text
    assert "short" in text


def test_history_holds_every_particle_with_full_precision(
    gaitswarm: Gaitswarm, finished: Finished, place: Place
) -> None:
    history = gaitswarm("history", finished.id, *place(finished.db), "--json").json
    assert history["id"] == finished.id
    assert [i["index"] for i in history["iterations"]] == [0, 1]
    evaluations = [e for i in history["iterations"] for e in i["evaluations"]]
    assert [e["particle"] for e in evaluations] == [0, 1, 2, 0, 1, 2]
    best = min(evaluations, key=lambda e: e["fitness"])
    assert best | {"search": None} == finished.job["best"]
    assert list(best["design"]) == history["variables"]
    assert set(best["scenarios"]["short"]["objectives"]) == {
        "torque",
        "acceleration",
        "angular_acceleration",
        "energy",
        "reciprocal_speed",
        "height_loss",
    }


def test_watch_replays_what_is_committed_and_ends_with_the_job(
    gaitswarm: Gaitswarm, finished: Finished, place: Place
) -> None:
    where = place(finished.db)
    result = gaitswarm("watch", finished.id, *where, "--json")
    assert result.code == 0
    lines = result.out.splitlines()
    assert [line[:20] for line in lines] == ['{"event":"iteration"'] * 2 + ['{"event":"state","da']
    result = gaitswarm("watch", finished.id, *where)
    assert result.code == 0
    assert "2/2 iterations: best" in result.err
    assert result.out == ""


def test_watching_a_cancelled_job_is_exit_code_1(
    gaitswarm: Gaitswarm, db: Path, place: Place, queued: str
) -> None:
    where = place(db)
    gaitswarm("cancel", queued, *where)
    result = gaitswarm("watch", queued, *where)
    assert result.code == 1
    assert "cancelled" in result.err


def test_a_bad_spec_is_exit_code_2_over_http_too(
    gaitswarm: Gaitswarm, small_spec: Path, db: Path, place: Place, queued: str
) -> None:
    where = place(db)
    result = gaitswarm("submit", "--spec", small_spec, "--scenarios", "moon", *where)
    assert result.code == 2
    assert "moon" in result.err
    assert len(gaitswarm("list", *where, "--json").json) == 1


def test_a_server_that_does_not_answer_is_exit_code_5(gaitswarm: Gaitswarm) -> None:
    result = gaitswarm("list", "--server", "http://127.0.0.1:9")
    assert result.code == 5
    assert "http://127.0.0.1:9" in result.err
    assert "gaitswarm serve" in result.err


def test_reading_a_missing_database_does_not_create_it(gaitswarm: Gaitswarm, new_db: Path) -> None:
    result = gaitswarm("list", "--db", new_db)
    assert result.code == 3
    assert str(new_db) in result.err
    assert not new_db.exists()


def test_without_options_commands_share_the_database_of_the_user(
    gaitswarm: Gaitswarm, small_spec: Path, user_data: Path
) -> None:
    submitted = gaitswarm("submit", "--spec", small_spec).out.strip()
    assert [job["id"] for job in gaitswarm("list", "--json").json] == [submitted]
    assert (user_data / "gaitswarm" / "gaitswarm.db").exists()


def test_the_environment_names_a_database_and_an_option_goes_before_it(
    gaitswarm: Gaitswarm, finished: Finished, new_db: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("GAITSWARM_DB", str(finished.db))
    assert [job["id"] for job in gaitswarm("list", "--json").json] == [finished.id]
    assert gaitswarm("list", "--db", new_db).code == 3


def test_a_job_is_on_a_server_or_in_a_database_not_both(gaitswarm: Gaitswarm, db: Path) -> None:
    result = gaitswarm("list", "--db", db, "--server", "http://127.0.0.1:9")
    assert result.code == 2
    assert "--server, --db" in result.err


def test_a_job_that_succeeded_is_extended_and_queued(
    gaitswarm: Gaitswarm, finished: Finished, place: Place, tmp_path: Path
) -> None:
    db = tmp_path / "copy.db"
    db.write_bytes(finished.db.read_bytes())
    where = place(db)
    extended = gaitswarm("extend", finished.id, "--iterations", "4", *where)
    assert extended.out == f"job {finished.id} is queued, with 2 of 4 iterations\n"
    assert gaitswarm("status", finished.id, *where, "--json").json["iterations_planned"] == 4
    refused = gaitswarm("extend", finished.id, "--iterations", "2", *where)
    assert refused.code == 2
    assert "iterations: must exceed the 2" in refused.err
    done = gaitswarm(
        *("optimize", "--resume", finished.id, "--db", db, "--evaluator", "in-process", "--json")
    ).json
    assert (done["state"], done["iterations"]) == ("succeeded", 4)


def test_a_job_has_a_priority_that_can_be_changed(
    gaitswarm: Gaitswarm, db: Path, small_spec: Path, place: Place, queued: str
) -> None:
    where = place(db)
    low = gaitswarm("submit", "--spec", small_spec, "--priority", "-3", *where).out.strip()
    changed = gaitswarm("prioritize", queued, "--priority", "2", *where)
    assert changed.out == f"job {queued} is queued, with priority 2\n"
    listed = gaitswarm("list", *where, "--json").json
    assert {job["id"]: job["priority"] for job in listed} == {queued: 2, low: -3}
    table = gaitswarm("list", *where).out.splitlines()
    assert [line.split()[3:5] for line in table if low in line] == [["-3", "0/2"]]
    assert gaitswarm("submit", "--spec", small_spec, "--priority", "11", *where).code == 2
    gaitswarm("cancel", queued, *where)
    assert gaitswarm("prioritize", queued, "--priority", "0", *where).code == 4


def test_submit_sets_the_webhook(
    gaitswarm: Gaitswarm, db: Path, small_spec: Path, place: Place
) -> None:
    where = place(db)
    submit = ("submit", "--spec", small_spec, *where)
    job = gaitswarm(*submit, "--notify", "https://ci.example/hook").out.strip()
    assert gaitswarm("cancel", job, *where).code == 0
    store = open_store(str(db))
    assert [sent.url for sent in store.outbox.about(job)] == ["https://ci.example/hook"]
    store.close()
    refused = gaitswarm(*submit, "--notify", "ci.example/hook")
    assert refused.code == 2 and "must be a URL such as" in refused.err


def test_the_list_can_be_searched_and_sorted(
    gaitswarm: Gaitswarm, small_spec: Path, db: Path, place: Place, queued: str
) -> None:
    where = place(db)
    gaitswarm("submit", "--spec", small_spec, "--name", "Another", *where)
    names = [job["name"] for job in gaitswarm("list", "--order", "name", *where, "--json").json]
    assert names == ["Another", "small"]
    found = gaitswarm("list", "--search", "SMA", *where, "--json").json
    assert [job["id"] for job in found] == [queued]
    refused = gaitswarm("list", "--order", "age", *where)
    assert refused.code == 2
    assert "created, fitness, name" in refused.err


def test_designs_are_ranked_by_another_preference(
    gaitswarm: Gaitswarm, finished: Finished, place: Place
) -> None:
    where = place(finished.db)
    own = '{"bias": [0, 0, 0, 0, 0], "exponent": [1, 0, 0, 0, 0]}'
    ranking = gaitswarm("rank", finished.id, "--preference", own, *where, "--json").json
    torques = [d["scenarios"]["short"]["objectives"]["torque"] for d in ranking["top"]]
    assert torques == sorted(torques) and len(torques) == ranking["evaluations"] == 6
    assert [d["fitness"] for d in ranking["top"]] == pytest.approx(torques)
    table = gaitswarm("rank", finished.id, "--preference", "B", "--top", "2", *where).out
    assert "6 designs; fitness of the job's best" in table and "rank correlation" in table
    assert len(table.splitlines()) == 4


def test_a_ranking_by_chapter_3_shows_fitness_and_figure_of_merit(
    gaitswarm: Gaitswarm, finished: Finished, place: Place
) -> None:
    asked = ("rank", finished.id, "--preference", "chapter-3", *place(finished.db))
    top = gaitswarm(*asked, "--json").json["top"]
    for design in top:
        f1, f2, f3, f4, f5, f6 = design["scenarios"]["short"]["objectives"].values()
        merit = 1e5 / (f1 * f2 * f3 * f4 * f5**2 * (abs(f6) + 0.03))
        assert design["figure_of_merit"] == pytest.approx(merit)
        assert design["fitness"] == pytest.approx(1e5 / merit)
    merits = [design["figure_of_merit"] for design in top]
    assert merits == sorted(merits, reverse=True) and len(merits) == 6
    assert "F (eq. 3.1)" in gaitswarm(*asked).out


@pytest.mark.parametrize(
    ("options", "field"),
    [
        (("--preference", "D"), "preference"),
        (("--preference", "{"), "preference: is not valid JSON"),
        (("--preference", '{"bias": [0, 0, 0, 0, 0]}'), "preference.exponent"),
        (("--preference", "A", "--top", "0"), "top"),
    ],
)
def test_a_ranking_that_makes_no_sense_is_refused_by_name(
    gaitswarm: Gaitswarm, finished: Finished, options: tuple[str, ...], field: str
) -> None:
    refused = gaitswarm("rank", finished.id, *options, "--db", finished.db)
    assert refused.code == 2
    assert field in refused.err
