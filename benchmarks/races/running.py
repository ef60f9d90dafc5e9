"""Runs of a plan that are not recorded yet, one after the other."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from benchmarks.races.plans import CHECKPOINTS, Plan
from benchmarks.races.records import Record, append, digest, read_all
from gaitswarm.services.optimizer.jobs.kinds.tournament import TournamentSpec
from gaitswarm.services.optimizer.jobs.provenance import job_provenance
from gaitswarm.services.optimizer.jobs.spec import create_optimizer


def run_missing(plan: Plan, path: Path) -> Iterator[Record]:
    """Run what the files of a folder lack of a plan, and append each run when it has ended.

    Args:
        plan: What is to be run.
        path: Of the file in the folder that new runs are appended to; it need not exist.

    Yields:
        Every new run, once it is in the file.

    Raises:
        BadRecord: A file is none of runs.
        InvalidRequest: A method or problem is unknown, or not installed.
    """
    known = {record.key for record in read_all(path.parent)}
    seeds = seeds_of(plan)
    for repetition, problem, method in plan.runs():
        spec = plan.spec(method, problem)
        settings = digest(spec.method.model_dump_json())
        key = (problem, method, settings, plan.evaluations, seeds[repetition])
        if key not in known:
            record = run(spec, method, repetition, seeds[repetition])
            append(path, record)
            yield record


def seeds_of(plan: Plan) -> list[int]:
    """Seeds of the repetitions, as `gaitswarm tournament` draws them."""
    spec = plan.spec(plan.methods[0], plan.problems[0])
    space, optimizer = spec.design_space(), create_optimizer(spec)
    seeds: list[int] = []
    while len(seeds) < plan.repetitions:
        positions = optimizer.ask(plan.repetitions - len(seeds))
        seeds += [int(row[0]) for row in space.simulated(space.designs(positions)).tolist()]
        optimizer.tell(np.zeros(len(positions)))
    return seeds


def run(spec: TournamentSpec, method: str, repetition: int, seed: int) -> Record:
    """Run a method once on the one problem of a job.

    Args:
        spec: Of a tournament's job with default settings.
        method: What it is called.
        repetition: Of the run, from 0.
        seed: Of the run.

    Returns:
        The run.
    """
    spec.check_can_be_simulated()
    (case,) = spec.cases({})
    begun = time.process_time()
    (row,) = case.run(np.array([[float(seed)]])).objectives.tolist()
    spent = time.process_time() - begun
    *curve, to_best, to_target = row
    best = [*curve, *[math.nan] * (len(CHECKPOINTS) - len(curve))]
    provenance = job_provenance(spec)
    walks = provenance.simulation
    libraries = walks.libraries | provenance.search_libraries
    return Record(
        problem=spec.case_names[0],
        method=method,
        settings=digest(spec.method.model_dump_json()),
        evaluations=spec.evaluations,
        repetition=repetition,
        seed=seed,
        best=tuple(best),
        to_best=to_best,
        to_target=to_target,
        cpu_s=spent,
        search=provenance.optimizer_digest[:10],
        simulator=digest(walks.code_digest + walks.robot_digest + walks.backend),
        libraries=" ".join(f"{name} {version}" for name, version in sorted(libraries.items())),
    )
