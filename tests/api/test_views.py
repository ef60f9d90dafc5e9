"""Views say all of what the domain objects do, in JSON that every parser reads."""

from __future__ import annotations

import json
from dataclasses import fields
from typing import Any, get_args

import numpy as np

import gaitswarm
from gaitswarm.services.optimizer.analysis.evaluations import evaluation_views
from gaitswarm.services.optimizer.jobs.iteration import Evaluation, Reevaluation
from gaitswarm.services.optimizer.jobs.job import Job
from gaitswarm.services.optimizer.store import Store
from gaitswarm.services.optimizer.views import StatusName, View
from gaitswarm.sim.gait.stability import Stability
from gaitswarm.sim.kernel.observation import WalkLog
from gaitswarm.sim.outcome import MEASUREMENTS, OBJECTIVES, RESULTS, Status
from gaitswarm.simulation import SimulationView, WalkLogView
from gaitswarm.views.job import BestView, JobView
from tests.api.conftest import Commit


def strict(text: str) -> Any:
    """Parsed as the standard has it: Python's own parser also takes NaN and Infinity."""

    def refuse(literal: str) -> None:
        raise ValueError(literal)

    return json.loads(text, parse_constant=refuse)


def test_objectives_and_statuses_are_the_simulators(job: Job) -> None:
    shown = JobView.from_job_and_best(job, None).objectives
    assert [(o.name, o.unit) for o in shown] == [(o.name, o.unit) for o in OBJECTIVES]
    measured = JobView.from_job_and_best(job, None).measurements
    assert [(o.name, o.unit) for o in measured] == [(m.name, m.unit) for m in MEASUREMENTS]
    assert get_args(StatusName) == tuple(status.label for status in Status)


class Leg(View):
    """A leg."""

    mass: float
    """Of its three links,
    in kilograms."""


class Foreleg(Leg):
    """A foreleg."""

    reach: float = 0.5
    """How far it gets [m]."""


def test_docstrings_below_fields_are_their_descriptions_in_schemas() -> None:
    fields = Foreleg.model_json_schema()["properties"]
    assert fields["mass"]["description"] == "Of its three links, in kilograms."
    assert (fields["reach"]["description"], fields["reach"]["default"]) == (
        "How far it gets [m].",
        0.5,
    )


def test_a_model_without_a_source_file_has_a_schema() -> None:
    defined: dict[str, Any] = {"__name__": "an_interpreter", "View": View}
    exec("class Hand(View):\n    mass: float", defined)  # noqa: S102
    assert "description" not in defined["Hand"].model_json_schema()["properties"]["mass"]


def test_numbers_that_are_not_finite_are_null(job: Job) -> None:
    evaluation = Evaluation(
        iteration=0,
        particle=0,
        design=np.zeros(len(job.spec.design_space().names)),
        objectives=np.array([[np.nan] * len(RESULTS), [np.inf] * len(RESULTS)]),
        statuses=np.array([Status.DIVERGED, Status.STALLED], dtype=np.uint8),
        fitness=np.inf,
    )

    (view,) = evaluation_views([evaluation], job.spec)

    assert strict(view.model_dump_json())["fitness"] is None
    assert set(view.scenarios["normal-fast"].objectives.values()) == {None}


def test_a_log_that_ended_early_has_nulls() -> None:
    columns = {name: np.array([[0.5, np.nan]]) for name in (f.name for f in fields(WalkLog))}

    view = WalkLogView.from_log(WalkLog(**columns))

    assert list(view.columns) == list(columns)
    assert {str(column.values) for column in view.columns.values()} == {"[[0.5, None]]"}
    assert strict(view.model_dump_json())


def test_a_design_that_was_never_walked_has_no_log() -> None:
    result = gaitswarm.simulate(
        {"P": 0.45, "I": 0.1, "stride": 1.0}, controller="pi", scenarios="normal-fast", log=True
    )
    view = SimulationView.from_result(result, [Stability(None, 0, 0.5)])
    (scenario,) = view.scenarios.values()
    assert (scenario.status, scenario.log) == ("unreachable", None)
    assert set(dict(scenario.measurements).values()) == {None}
    assert view.fitness is None


def test_a_job_view_is_read_from_json_with_every_bit_of_the_best_design(
    store: Store, job: Job, commit: Commit
) -> None:
    commit(job, 3)
    stored, best = store.job(job.id), store.best(job.id)
    assert best is not None

    sent = JobView.from_job_and_best(stored, best).model_dump_json()
    read = JobView.model_validate_json(sent)

    assert (read.id, read.state, read.spec) == (stored.id, stored.state, stored.spec)
    assert (read.iterations, read.evaluations) == (3, 12)
    assert read.best is not None and read.best_fitness == read.best.fitness == best.fitness
    assert list(read.best.design.values()) == best.design.tolist()
    walks = [
        [*walk.objectives.values(), *walk.measurements.values()]
        for walk in read.best.scenarios.values()
    ]
    assert walks == best.objectives.tolist()
    assert read.model_dump_json() == sent


def test_a_best_that_was_found_in_single_is_shown_in_double_with_the_difference(
    store: Store, job: Job, commit: Commit
) -> None:
    commit(job, 1)
    found = store.best(job.id)
    assert found is not None
    doubled = Reevaluation(
        found.particle, 2.0 * found.objectives, found.statuses, 2.0 * found.fitness
    )
    spec = job.spec.model_copy(update={"precision": "single"})

    view = BestView.from_evaluation(found._replace(reevaluation=doubled), spec)

    assert view.fitness == doubled.fitness
    walks = [
        [*walk.objectives.values(), *walk.measurements.values()] for walk in view.scenarios.values()
    ]
    assert walks == doubled.objectives.tolist()
    assert view.search is not None
    assert (view.search.precision, view.search.fitness) == ("single", found.fitness)
    assert view.search.difference == -0.5
    assert strict(view.model_dump_json())["search"]["difference"] == -0.5
    assert BestView.from_evaluation(found, job.spec).search is None
