"""`auto`: a name that stands for a method until a job is submitted."""

from __future__ import annotations

from dataclasses import replace

import pytest
from pydantic import ValidationError

from gaitswarm.services.optimizer.jobs.documents import SPECS
from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec
from gaitswarm.services.optimizer.search.automatic import RULES, AutoSettings, Rule, chosen_method
from gaitswarm.services.optimizer.search.pso import PsoSettings
from gaitswarm.services.optimizer.search.random_search import RandomSearchSettings
from gaitswarm.services.optimizer.search.registry import (
    DEFAULT_METHOD,
    LONGEST_REPLAY,
    METHODS,
    OPTIMIZERS,
    OptimizerSettings,
)
from gaitswarm.services.optimizer.search.space import Axis, Space
from gaitswarm.services.optimizer.service import JobService
from gaitswarm.services.optimizer.store import Store
from tests.calibration.conftest import spec as calibration

LINE = Space([Axis(0.0, 1.0)])
PLANE = Space([Axis(0.0, 1.0), Axis(0.0, 1.0)])
STEPS = Space([Axis(0.0, 9.0, "integer")])

SOMETIMES = RandomSearchSettings()
OTHERWISE = PsoSettings(inertia_end=0.5)


def chosen(rule: Rule, space: Space, budget: int) -> OptimizerSettings:
    return chosen_method(AutoSettings(), space, budget, (rule, Rule(OTHERWISE)))


def test_it_stands_for_the_default_method() -> None:
    assert JobSpec.model_validate({"optimizer": "auto"}).search == OPTIMIZERS[DEFAULT_METHOD]


def test_the_last_rule_suits_every_search() -> None:
    for space in (LINE, STEPS, Space([Axis(0.0, 3.0, "categorical")] * 100)):
        assert RULES[-1].suits(space, 10**10)


def test_rules_go_by_budget_dimension_and_kinds_of_variables() -> None:
    few = Rule(SOMETIMES, largest_budget=100)
    assert chosen(few, LINE, 100) == SOMETIMES
    assert chosen(few, LINE, 101) == OTHERWISE
    low = Rule(SOMETIMES, largest_dimension=1)
    assert chosen(low, LINE, 100) == SOMETIMES
    assert chosen(low, PLANE, 100) == OTHERWISE
    smooth = Rule(SOMETIMES, kinds=frozenset({"continuous"}))
    assert chosen(smooth, PLANE, 100) == SOMETIMES
    assert chosen(smooth, STEPS, 100) == OTHERWISE


def test_no_method_is_chosen_that_could_not_be_resumed() -> None:
    assert METHODS[SOMETIMES.name].replays
    assert chosen(Rule(SOMETIMES), LINE, LONGEST_REPLAY) == SOMETIMES
    assert chosen(Rule(SOMETIMES), LINE, LONGEST_REPLAY + 1) == OTHERWISE


def test_no_method_is_chosen_that_is_not_installed(monkeypatch: pytest.MonkeyPatch) -> None:
    assert chosen(Rule(SOMETIMES), LINE, 100) == SOMETIMES
    without = replace(METHODS[SOMETIMES.name], libraries=("no-such-library",))
    monkeypatch.setitem(METHODS, SOMETIMES.name, without)
    assert chosen(Rule(SOMETIMES), LINE, 100) == OTHERWISE


def test_the_size_of_iterations_stays_and_with_it_the_budget() -> None:
    spec = JobSpec.model_validate({"optimizer": {"name": "auto", "particles": 8}})
    assert spec.resolved().optimizer.particles == 8
    assert spec.resolved().budget == spec.budget == 25 * 8


def test_a_spec_that_is_not_resolved_yet_searches_by_the_same_method() -> None:
    spec = JobSpec.model_validate({"optimizer": "auto", "seed": 5})
    expected = spec.resolved().create_search().ask()
    assert spec.create_search().ask().tobytes() == expected.tobytes()


def test_a_job_of_any_kind_is_resolved_to_the_method() -> None:
    identification = {"kind": "identification", "recordings": ["0" * 32]}
    for document in ({}, identification, calibration().model_dump()):
        asked = SPECS.validate_python({**document, "optimizer": "auto"})
        assert asked.resolved().optimizer == OPTIMIZERS[DEFAULT_METHOD]


def test_a_stored_job_names_the_method(store: Store) -> None:
    job, _ = JobService(store).submit(JobSpec.model_validate({"optimizer": "auto"}))
    assert store.job(job.id).spec.optimizer.name == DEFAULT_METHOD


def test_it_has_no_settings_of_a_method() -> None:
    with pytest.raises(ValidationError, match="no setting of auto; known are particles"):
        JobSpec.model_validate({"optimizer": {"name": "auto", "inertia_end": 0.5}})
