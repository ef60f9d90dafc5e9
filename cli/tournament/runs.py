"""The jobs of a tournament, run several at a time; and their runs as a table."""

from __future__ import annotations

import json
import math
import threading
from collections.abc import Mapping
from concurrent.futures import FIRST_EXCEPTION, Future, ThreadPoolExecutor, wait
from contextlib import closing
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from gaitswarm.cli.atomic_file import replacing
from gaitswarm.cli.exit_codes import JobEnded
from gaitswarm.cli.output import note
from gaitswarm.jobs.database.embedded import earlier_job, taken_up
from gaitswarm.jobs.open import database_to_write
from gaitswarm.services.optimizer.analysis.tournaments.entrants import by_problem
from gaitswarm.services.optimizer.analysis.tournaments.tournament import Results, Runs, runs_of
from gaitswarm.services.optimizer.errors import InvalidRequest
from gaitswarm.services.optimizer.jobs.columns import EvaluationColumns
from gaitswarm.services.optimizer.jobs.job import Job, JobState
from gaitswarm.services.optimizer.jobs.kinds.tournament import TournamentSpec
from gaitswarm.services.optimizer.service import JobService
from gaitswarm.services.runtime import open_evaluator, open_store, run_embedded, stop_on_signals
from gaitswarm.settings import read_settings
from gaitswarm.tables import Table

if TYPE_CHECKING:
    from gaitswarm.cli.inputs.options import WorkerOptions
    from gaitswarm.services.optimizer.run.evaluator import Evaluator
    from gaitswarm.services.optimizer.store.port.base import Store
    from gaitswarm.settings import Settings

RUNS_FILE: Final = "runs.parquet"

_BEST: Final = "best_"
"""Of columns, before the evaluations of a checkpoint."""


@dataclass(frozen=True, slots=True)
class Entry:
    """A method's part in a tournament, once its job has ended.

    Attributes:
        spec: Of its job.
        job_id: Identifier of that.
        columns: Its evaluations; the first are the tournament's.
    """

    spec: TournamentSpec
    job_id: str
    columns: EvaluationColumns


def run_jobs(specs: Mapping[str, TournamentSpec], workers: WorkerOptions) -> dict[str, Entry]:
    """Run the jobs that have not been run before, and go on with those that were stopped.

    One more than there are workers at a time, so that none of these waits for a job's last run.
    """
    settings = read_settings(**asdict(workers))
    with closing(open_store(database_to_write(settings))) as store:
        service = JobService(store)
        jobs = {label: _job(service, spec) for label, spec in specs.items()}
        left = {
            label: job
            for label, job in jobs.items()
            if job.progress.iterations < specs[label].iterations
        }
        if left:
            _run(left, store, settings)
        return {
            label: Entry(spec, jobs[label].id, service.columns(store.job(jobs[label].id)))
            for label, spec in specs.items()
        }


def _job(service: JobService, spec: TournamentSpec) -> Job:
    """The job that was submitted before to do the same, extended if need be; or a new one."""
    job = earlier_job(service, spec, any_budget=True)
    if job is None:
        return service.submit(spec)[0]
    if job.spec.iterations < spec.iterations:
        job = service.extend(job.id, spec.iterations)
    return taken_up(service, job.id, accept_changes=False)


def _run(jobs: Mapping[str, Job], store: Store, settings: Settings) -> None:
    stop = threading.Event()
    lock = threading.Lock()
    opened: list[Evaluator] = []

    def evaluator() -> Evaluator:
        with lock:
            if not opened:
                kind, address = settings.evaluator, settings.ray_address
                opened.append(
                    open_evaluator(
                        kind, address=address, cpus=settings.cpus, should_stop=stop.is_set
                    )
                )
            return opened[0]

    def run(label: str, job: Job) -> None:
        def committed(index: int) -> None:
            note(f"{label}: run {index + 1} of {job.spec.iterations}")

        ended = run_embedded(
            store,
            evaluator,
            job.id,
            on_commit=lambda done, _: committed(done.iteration),
            on_follow=lambda iteration: committed(iteration.index),
            on_retry=lambda seconds, why: note(f"{label}: {why}; again in {seconds:.0f} s"),
            on_news=lambda news: note(f"{label}: {news}"),
            stop=stop,
        )
        if ended.state is not JobState.SUCCEEDED and not stop.is_set():
            why = f": {ended.error}" if ended.error else ""
            raise JobEnded(f"job {ended.id} of {label} is {ended.state}{why}")

    try:
        with stop_on_signals(stop):
            slots = settings.cpus or _cpus()
            with ThreadPoolExecutor(slots + 1, thread_name_prefix="tournament") as pool:
                _await([pool.submit(run, label, job) for label, job in jobs.items()], stop)
    finally:
        for workers in opened:
            workers.close()
    if stop.is_set():
        note("stopped; the same command goes on")
        raise KeyboardInterrupt


def _await(runs: list[Future[None]], stop: threading.Event) -> None:
    """Until all have ended; the first that fails stops the others, and is raised."""
    try:
        while wait(runs, timeout=0.5, return_when=FIRST_EXCEPTION).not_done:
            if any(run.done() and run.exception() for run in runs):
                break
        for run in runs:
            if run.done():
                run.result()
    except BaseException:
        stop.set()
        for run in runs:
            run.cancel()
        raise


def _cpus() -> int:
    from gaitswarm.services.worker.in_process import available_cpus

    return available_cpus()


def results_of(entries: Mapping[str, Entry], repetitions: int) -> dict[str, dict[str, Runs]]:
    """Runs by problem, then by method."""
    return by_problem(
        {label: runs_of(entry.spec, entry.columns, repetitions) for label, entry in entries.items()}
    )


def write_runs(folder: Path, entries: Mapping[str, Entry], results: Results) -> Path:
    """Write every run as a row of `runs.parquet`."""
    import pyarrow.parquet as pq

    rows = [
        _row(problem, label, entries[label], runs, k)
        for problem, by_method in results.items()
        for label, runs in by_method.items()
        for k in range(len(runs))
    ]
    table = Table({name: np.array([row[name] for row in rows]) for name in rows[0]})
    path = folder / RUNS_FILE
    with replacing(path, "output") as file:
        pq.write_table(table.to_arrow(), file)
    return path


def _row(problem: str, label: str, entry: Entry, runs: Runs, index: int) -> dict[str, Any]:
    design = entry.columns.designs[index].tolist()
    curve = zip(runs.checkpoints.tolist(), runs.best[index].tolist(), strict=True)
    return {
        "problem": problem,
        "method": label,
        "repetition": index,
        "job": entry.job_id,
        "drawn": json.dumps(entry.spec.design_space().shown(design)),
        "settings": entry.spec.method.model_dump_json(),
        "dimension": runs.dimension,
        "target": math.nan if runs.target is None else runs.target,
        "evaluations_to_best": runs.to_best[index],
        "evaluations_to_target": runs.to_target[index],
        **{f"{_BEST}{count}": value for count, value in curve},
    }


def read_runs(folder: Path, option: str) -> dict[str, dict[str, Runs]]:
    """Read the runs of an earlier tournament."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    path = folder / RUNS_FILE
    try:
        table = pq.read_table(path)
    except (OSError, pa.ArrowException) as error:
        raise InvalidRequest(f"cannot read {path}: {error}", field=option) from error
    columns = {name: np.asarray(table.column(name).to_numpy()) for name in table.column_names}
    names = [name for name in columns if name.startswith(_BEST)]
    best = np.stack([columns[name] for name in names], axis=1)
    found: dict[str, dict[str, Runs]] = {}
    pairs = dict.fromkeys(zip(columns["problem"], columns["method"], strict=True))
    for problem, method in pairs:
        mine = (columns["problem"] == problem) & (columns["method"] == method)
        target = float(columns["target"][mine][0])
        found.setdefault(problem, {})[method] = Runs(
            checkpoints=np.array([int(name.removeprefix(_BEST)) for name in names]),
            best=best[mine],
            to_best=columns["evaluations_to_best"][mine],
            to_target=columns["evaluations_to_target"][mine],
            dimension=int(columns["dimension"][mine][0]),
            target=None if math.isnan(target) else target,
        )
    return found
