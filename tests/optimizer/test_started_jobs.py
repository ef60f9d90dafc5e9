"""Jobs that start from designs: given as such, from a CSV file, or the best of earlier jobs."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gaitswarm.services.optimizer.analysis.history import read_columns
from gaitswarm.services.optimizer.errors import InvalidRequest
from gaitswarm.services.optimizer.jobs.job import Job, JobState
from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec
from gaitswarm.services.optimizer.run.runner import run_embedded
from gaitswarm.services.optimizer.service import JobService
from gaitswarm.services.optimizer.store import Store
from gaitswarm.specs import chosen_spec
from gaitswarm.tables import encoded_table
from tests.examples.jobs import history
from tests.optimizer.formula import HERE, SPEC, FormulaEvaluator

DESIGNS = ({"P": 0.25, "I": 0.125}, {"P": 0.75, "I": 0.5})


def spec(start: Any, **given: Any) -> JobSpec:
    return JobSpec.model_validate({**SPEC.model_dump(), **given, "start": start})


def run(store: Store, wanted: JobSpec) -> Job:
    claim = JobService(store, provenance=lambda _: HERE).submit_embedded(wanted)
    job = run_embedded(store, FormulaEvaluator(), claim, accepts_changes=True)
    assert job.state is JobState.SUCCEEDED
    return job


def evaluated(store: Store, job: Job) -> list[dict[str, float | str]]:
    space = job.spec.design_space()
    rows = store.evaluations_between(job.id, 0, 1_000_000)
    return [space.shown(row.design.tolist()) for row in rows]


def best_designs(store: Store, job: Job, count: int) -> list[dict[str, float | str]]:
    rows = store.evaluations_between(job.id, 0, 1_000_000)
    best = sorted(rows, key=lambda row: row.fitness)[:count]
    return [job.spec.design_space().shown(row.design.tolist()) for row in best]


def csv(tmp_path: Path, *lines: str) -> Path:
    path = tmp_path / "designs.csv"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def test_start_designs_are_judged_first_and_count_as_budget(store: Store) -> None:
    job = run(store, spec(DESIGNS))
    assert evaluated(store, job)[:2] == list(DESIGNS)
    assert job.progress.evaluations == SPEC.budget


def test_the_best_of_a_start_is_never_lost(store: Store) -> None:
    earlier = run(store, spec((), iterations=12))
    for method in ("pso", "random"):
        optimizer = {"name": method, "particles": 4}
        later = run(store, spec({"jobs": [earlier.id]}, seed=99, optimizer=optimizer))
        assert later.progress.best_fitness is not None
        assert earlier.progress.best_fitness is not None
        assert later.progress.best_fitness <= earlier.progress.best_fitness


def test_a_started_job_depends_on_no_other_job(store: Store) -> None:
    earlier = run(store, spec((), iterations=2))
    job = run(store, spec({"jobs": [earlier.id], "count": 3}, seed=99))
    assert job.spec.start == tuple(best_designs(store, earlier, 3))
    alone = run(store, spec(job.spec.start, seed=99))
    assert history(store, alone.id) == history(store, job.id)


def test_several_jobs_give_the_best_of_each_first(store: Store) -> None:
    jobs = [run(store, spec((), seed=seed, iterations=2)) for seed in (1, 2)]
    wanted = spec({"jobs": [job.id for job in jobs], "count": 3})
    job, _ = JobService(store).submit(wanted)
    firsts = [best_designs(store, job, 1)[0] for job in jobs]
    assert job.spec.start == (*firsts, best_designs(store, jobs[0], 2)[1])


def test_a_variable_that_is_held_here_is_left_out_of_an_earlier_design(store: Store) -> None:
    earlier = run(store, spec((), iterations=3))
    variables = [v for v in SPEC.design_space().variables if v.name == "P"]
    job = run(
        store, spec({"jobs": [earlier.id]}, variables=variables, fixed={"I": 0.3}, iterations=2)
    )
    assert [set(design) for design in job.spec.start] == [{"P"}] * 5
    assert evaluated(store, job)[0]["I"] == 0.3


@pytest.mark.parametrize(
    ("start", "message"),
    [
        ([{"P": 0.2}], r"start\.0\.I: missing"),
        ([DESIGNS[0], {"P": 9.0, "I": 0.5}], r"start\.1\.P: 9 is outside the bounds .* widen"),
        ([{"P": "much", "I": 0.5}], r"start\.0\.P: 'much' is not a number"),
        ([{"P": 0.2, "I": 0.5, "D": 1.0}], r"start\.0\.D: no variable of this job"),
        (DESIGNS * 13, r"start: 26 designs are more than the budget of 24"),
        ("designs", r"start\n  must be a list of designs"),
    ],
)
def test_a_design_that_does_not_fit_is_refused_with_its_place(start: Any, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        spec(start)


def test_integers_are_whole_and_fixed_variables_keep_their_value() -> None:
    fuzzy = JobSpec(controller="fuzzy-pi", fixed={"FOR": 1000.0})
    middle: dict[str, Any] = {
        v.name: (v.low + v.high) / 2 for v in fuzzy.design_space().variables
    } | {"FOR": 1000.0}
    assert JobSpec.model_validate({**fuzzy.model_dump(), "start": [middle]}).start == (middle,)
    for name, value, message in (
        ("FOMF", 1.5, r"start\.0\.FOMF: 1.5 is not an integer"),
        ("FOR", 999.0, r"start\.0\.FOR: 999.* is not the job.s fixed value, 1000"),
    ):
        with pytest.raises(ValueError, match=message):
            JobSpec.model_validate({**fuzzy.model_dump(), "start": [{**middle, name: value}]})


def test_earlier_jobs_that_cannot_be_used_are_refused_by_name(store: Store) -> None:
    service = JobService(store, provenance=lambda _: HERE)
    earlier = run(store, spec(()))
    queued, _ = service.submit(spec(()))
    narrow = [{"name": "P", "low": 4.0, "high": 5.0}, "I"]
    for wanted, message in (
        (spec({"jobs": [earlier.id, "nothing"]}), r"start\.jobs\.1: there is no job 'nothing'"),
        (spec({"jobs": [queued.id]}), r"start\.jobs\.0: .*no successful design"),
        (spec({"jobs": [earlier.id], "count": 25}, iterations=2), r"start\.count: .*budget of 8"),
        (
            spec({"jobs": [earlier.id]}, variables=narrow),
            r"start\.jobs\.0: P of its best design no\. 1: .* outside the bounds 4 to 5",
        ),
    ):
        with pytest.raises(InvalidRequest, match=message):
            service.submit(wanted)


def test_a_file_of_designs_is_read_row_by_row(tmp_path: Path) -> None:
    path = csv(tmp_path, "P,I", "0.25,0.125", "0.25,0.125", "0.75,0.5")
    assert chosen_spec(SPEC, {"start": path}).start == DESIGNS


def test_an_exported_job_is_a_file_of_designs(store: Store, tmp_path: Path) -> None:
    earlier = run(store, spec(()))
    pieces = read_columns(store, earlier)
    path = tmp_path / "export.csv"
    path.write_bytes(b"".join(encoded_table("csv", earlier.spec, pieces)))
    started = chosen_spec(SPEC, {"start": str(path)}).start
    assert isinstance(started, tuple)
    assert list(started[:3]) == best_designs(store, earlier, 3)
    finite = [row for row in store.evaluations_between(earlier.id, 0, 99) if row.fitness < np.inf]
    assert len(started) == len({row.design.tobytes() for row in finite})


@pytest.mark.parametrize(
    ("lines", "message"),
    [
        (["P,I", "0.25,0.125", "0.3,7"], r"start\.1\.I: 7 is outside"),
        (["P,I", "0.25,"], r"start\.0\.I: missing"),
        (["P,I", "0.25,high"], r"start\.0\.I: 'high' is not a number"),
        (["P,I", "0.25,nan"], r"start\.0\.I: .*finite"),
        (["P,I", "0.25,0.1,3"], r"line 2 has more cells"),
        (["P,I"], r"has no designs"),
    ],
)
def test_a_file_that_does_not_fit_is_refused(
    tmp_path: Path, lines: Sequence[str], message: str
) -> None:
    with pytest.raises(InvalidRequest, match=message):
        chosen_spec(SPEC, {"start": csv(tmp_path, *lines)})
    with pytest.raises(InvalidRequest, match=r"cannot read .*none\.csv"):
        chosen_spec(SPEC, {"start": tmp_path / "none.csv"})
