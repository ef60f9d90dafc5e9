"""A program that uses the library, as type checkers see it: `make lint` checks it strictly."""

from __future__ import annotations

from collections.abc import Iterator
from typing import assert_type

import numpy as np
from numpy.typing import NDArray

import gaitswarm


def simulations() -> None:
    one = gaitswarm.simulate({"P": 0.4, "I": 0.1}, controller="pi", scenarios="normal-fast")
    gaitswarm.simulate({"P": np.linspace(0.1, 0.9, 9), "I": 0.1}, scenarios=["1", "2"])
    gaitswarm.simulate([{"P": 0.4, "I": 0.1}], scenarios=gaitswarm.SCENARIOS[0])
    gaitswarm.simulate(one.table(), robot=gaitswarm.RobotVariant(contact_law="stick"))
    gaitswarm.simulate({"P": 0.4}, controller=2)  # type: ignore[arg-type]
    assert_type(one, gaitswarm.SimulationResult)
    assert_type(one.fitness, NDArray[np.float64])
    assert_type(one["normal-fast"].logs, tuple[gaitswarm.WalkLog | None, ...])


def optimizations() -> None:
    run = gaitswarm.optimize(controller="pi", iterations=3, particles=4, db="jobs.db")
    gaitswarm.optimize(gaitswarm.JobSpec(seed=3), on_iteration=lambda i: print(i.best))  # noqa: T201
    gaitswarm.optimize(resume=run.job.id, evaluator="ray")
    gaitswarm.optimize(sed=3)  # type: ignore[call-arg]
    gaitswarm.optimize(iterations="3")  # type: ignore[arg-type]
    assert_type(run, gaitswarm.OptimizationResult)
    assert_type(run.best, gaitswarm.BestView)
    assert_type(run.evaluations(), gaitswarm.EvaluationTable)
    assert_type(run.verdict(), gaitswarm.VerdictView)
    assert_type(gaitswarm.__version__, str)


def reached() -> None:
    with gaitswarm.open("jobs.db") as here, gaitswarm.connect("http://127.0.0.1:8000") as there:
        for jobs in (here, there):
            ask(jobs)
        assert_type(here.run("k2q7zr5dm9xw"), gaitswarm.JobView)
        there.run("k2q7zr5dm9xw")  # type: ignore[attr-defined]


def ask(jobs: gaitswarm.Jobs) -> None:
    job = jobs.submit(controller="pi", scenarios=["1", gaitswarm.SCENARIOS[1]])
    assert_type(job, gaitswarm.JobView)
    assert_type(jobs.iterations(job.id), Iterator[gaitswarm.IterationView])
    for event in jobs.follow(job.id):
        if isinstance(event, gaitswarm.IterationView):
            assert_type(event.best, float | None)
        else:
            assert_type(event, gaitswarm.StateView)
    jobs.submit(scenario="1")  # type: ignore[call-arg]


async def ask_in_a_task(jobs: gaitswarm.AsyncJobs) -> None:
    job = await jobs.submit(gaitswarm.JobSpec(controller="pi"), seed=2)
    assert_type(job, gaitswarm.JobView)
    await jobs.submit(sed=2)  # type: ignore[call-arg]
    await jobs.front(job.id, most="1")  # type: ignore[arg-type]
    async for iteration in jobs.iterations(job.id):
        assert_type(iteration, gaitswarm.IterationView)
