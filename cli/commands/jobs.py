"""Commands about jobs."""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator
from contextlib import closing
from typing import TYPE_CHECKING, Annotated

import typer

from gaitswarm.cli.options import (
    AcceptChanges,
    ConstraintOption,
    JobId,
    JobIds,
    JobName,
    Json,
    NoConstraints,
    Notify,
    NoWorseThan,
    Place,
    Priority,
    RobotOption,
    ScenarioAggregate,
    ScenarioWeight,
    SpecOptions,
    WorkerOptions,
    completed,
    name_and_bounds,
    one_of,
)
from gaitswarm.cli.output import Parts, Printed, note, print_table, print_text, write_json_items
from gaitswarm.cli.tables import (
    MISSING,
    best_parts,
    job_parts,
    jobs_table,
    lineage_line,
    number,
    place,
    table,
    verdict_lines,
    worth,
)
from gaitswarm.services.optimizer.errors import InvalidRequest

if TYPE_CHECKING:
    from gaitswarm.jobs.base import Jobs
    from gaitswarm.services.optimizer.analysis.comparison import JobComparisonView
    from gaitswarm.specs import ForkOptions
    from gaitswarm.views.job import HistoryIterationView, JobSummaryView, JobView


def submit(
    options: SpecOptions,
    idempotency_key: Annotated[
        str | None, typer.Option(help="Repeating a key with the same spec creates no second job.")
    ] = None,
    priority: Priority = 0,
    notify: Notify = None,
    *,
    place: Place,
) -> Printed:
    """Queue a job for a running server; `optimize` runs one in this process."""
    from gaitswarm.cli.inputs import build_spec

    spec = build_spec(options)
    with place.open(create=True) as jobs:
        job = jobs.submit(
            spec, idempotency_key=idempotency_key, priority=priority, notify_url=notify
        )
        return job, _submitted(job, f"{job.state}; ", jobs.place)


def _submitted(job: JobView, state: str, place: str) -> Iterator[str]:
    yield job.id
    note(f"{state}to follow it, run: gaitswarm watch {job.id}{place}")


def list_jobs(
    state: str | None = None,
    forks_of: Annotated[str | None, typer.Option(metavar="ID", callback=completed)] = None,
    search: Annotated[str, typer.Option(metavar="TEXT")] = "",
    robot: Annotated[str | None, typer.Option(metavar="NAME")] = None,
    controller: Annotated[str | None, typer.Option(metavar="NAME")] = None,
    preference: Annotated[str | None, typer.Option(metavar="NAME")] = None,
    tag: str | None = None,
    archived: Annotated[bool | None, typer.Option("--archived/--not-archived")] = None,
    everything: Annotated[bool, typer.Option("--all")] = False,
    order: str = "created",
    reverse: Annotated[bool, typer.Option("--reverse")] = False,
    limit: Annotated[int, typer.Option(min=1)] = 50,
    *,
    jobs: Jobs,
) -> Printed:
    """List jobs, newest first by default.

    Args:
        state: Only jobs in this state: queued, running, pausing, paused, cancelled, failed or
            succeeded.
        forks_of: Only forks of this job.
        search: Only jobs whose name, id, note or tags contain this.
        robot: Only jobs of this robot; `own`: custom robots.
        controller: Only jobs that tune this controller.
        preference: Only jobs of this preference; `own`: custom ones.
        tag: Only jobs with this tag.
        archived: Only archived jobs, or only others (the default).
        everything: Include archived jobs.
        order: created (newest first), fitness (best first), gain (greatest first), name, state,
            iterations, evaluations, priority, rate (most first) or time_left.
        reverse: Reverse the order.
        limit: Maximum number of jobs.
    """
    from gaitswarm.services.optimizer.jobs.job import JobOrder, JobState

    if everything and archived is not None:
        raise InvalidRequest("--all and --archived are mutually exclusive", field="all")
    hidden = None if everything else bool(archived)
    job_state = None if state is None else one_of(JobState, state, "state")
    job_order = one_of(JobOrder, order, "order")

    def matches(most: int) -> Iterator[JobSummaryView]:
        return jobs.jobs(
            state=job_state,
            parent=forks_of,
            search=search,
            archived=hidden,
            robot=robot,
            controller=controller,
            preference=preference,
            tag=tag,
            order=job_order,
            reverse=reverse,
            limit=most,
        )

    def parts() -> Parts:
        rows = list(matches(limit + 1))
        if rows:
            yield jobs_table(rows[:limit])
        else:
            note("no job matches" if everything else "no job matches; --all includes archived jobs")
        if len(rows) > limit:
            note(f"more than {limit} jobs match: raise --limit, or narrow by --search or --tag")

    return matches(limit), parts()


def status(job_id: JobId, *, jobs: Jobs) -> Printed:
    """Show a job's state, progress and best design, and the reason if it failed."""
    job = jobs.job(job_id)
    return job, job_parts(job)


def watch(job_id: JobId, *, place: Place, as_json: Json = False) -> None:
    """Follow a job until it ends; the exit code is 0 if it succeeded.

    With --json, every committed iteration and every change of state is one line.
    """
    from gaitswarm.cli.progress import watch_as_json, watch_with_progress

    with place.open() as jobs:
        follow = watch_as_json if as_json else watch_with_progress
        follow(jobs, job_id)


def pause(job_id: JobId, *, jobs: Jobs) -> Printed:
    """Pause a job after its current iteration."""
    return _changed(jobs.pause(job_id))


def resume(job_id: JobId, accept_changes: AcceptChanges = False, *, jobs: Jobs) -> Printed:
    """Resume a paused or failed job."""
    return _changed(jobs.resume(job_id, accept_changes=accept_changes))


def cancel(job_id: JobId, *, jobs: Jobs) -> Printed:
    """Cancel a job for good; committed iterations remain."""
    return _changed(jobs.cancel(job_id))


def _changed(job: JobView) -> tuple[JobView, str]:
    return job, f"job {job.id} is {job.state}"


def extend(
    job_id: JobId,
    iterations: Annotated[int, typer.Option(help="Total budget, including iterations done.")],
    *,
    jobs: Jobs,
) -> Printed:
    """Extend a job's budget; a job that has succeeded continues."""
    job = jobs.extend(job_id, iterations)
    return job, f"job {job.id} is {job.state}, with {job.spent}"


def prioritize(job_id: JobId, priority: Priority, *, jobs: Jobs) -> Printed:
    """Change the priority of a queued or running job."""
    job = jobs.prioritize(job_id, priority)
    return job, f"job {job.id} is {job.state}, with priority {job.priority}"


def history(job_id: JobId, *, place: Place, as_json: Json = False) -> None:
    """Show every committed iteration.

    With --json, also every design: values, fitness, statuses and raw objectives.
    """
    with place.open() as jobs:
        job = jobs.job(job_id)
        if as_json:
            _print_history(job, jobs.history(job_id))
            return
        constrained = job.least_violation is not None
        rows = [
            (
                *(i.index, *map(number, (i.best_so_far, i.best, i.mean, i.median, i.worst))),
                *(i.failed, *([i.infeasible, i.least_violation] if constrained else [])),
                f"{i.evaluate_seconds:.2f}",
            )
            for i in jobs.iterations(job_id)
        ]
    headings = [">iteration", "best so far", "best", "mean", "median", "worst", "failed"]
    headings += ["infeasible", "violation"] if constrained else []
    print_table(table([*headings, "seconds"], rows))


def _print_history(job: JobView, iterations: Iterator[HistoryIterationView]) -> None:
    """Stream one JSON document: a history may be larger than memory."""
    head = {
        "id": job.id,
        "state": job.state.value,
        "variables": job.spec.design_space().names,
        "provenance": [record.model_dump(mode="json") for record in job.provenance],
    }
    opening = json.dumps(head, indent=2).removesuffix("\n}")
    sys.stdout.write(f'{opening},\n  "iterations": ')
    write_json_items(sys.stdout, iterations, indent=2)
    sys.stdout.write("\n}\n")


def best(job_id: JobId, *, jobs: Jobs) -> Printed:
    """Show a job's best design so far, by scenario."""
    view = jobs.best(job_id)

    def parts() -> Parts:
        job = jobs.job(job_id)
        yield f"job {job_id}: fitness {worth(view, digits=6)}, design {place(view)}"
        yield from best_parts(view, job)
        if job.kind == "tuning":
            yield from verdict_lines(jobs.verdict(job_id), jobs.place)

    return view, parts()


def diff(job_ids: JobIds, *, jobs: Jobs) -> Printed:
    """Compare up to 12 jobs: results, and differences of their specs.

    With --json, also convergence and the distribution of fitness.
    """
    view = jobs.comparison(job_ids)
    return view, _comparison(view)


def _comparison(view: JobComparisonView) -> Parts:
    rows = [
        ("name", *(job.name or MISSING for job in view.jobs)),
        ("state", *(job.state for job in view.jobs)),
        ("best fitness", *(number(job.best_fitness, 5) for job in view.jobs)),
        ("evaluations", *(job.evaluations for job in view.jobs)),
        *((difference.field, *difference.values) for difference in view.differences),
    ]
    yield table(["", *(f"<{job.id}" for job in view.jobs)], rows)
    if not view.comparable:
        yield "the jobs use different measures, so their fitness is not comparable"


def fork(
    job_id: JobId,
    from_iteration: Annotated[int, typer.Option("--from", metavar="K")],
    preference: str | None = None,
    constraint: ConstraintOption = None,
    no_worse_than: NoWorseThan = None,
    no_constraints: NoConstraints = False,
    scenario_weight: ScenarioWeight = None,
    scenario_aggregate: ScenarioAggregate = None,
    optimizer: Annotated[str | None, typer.Option(metavar="NAME")] = None,
    optimizer_settings: Annotated[str | None, typer.Option(metavar="JSON|FILE")] = None,
    particles: int | None = None,
    scenarios: str | None = None,
    robot: RobotOption = None,
    bounds: Annotated[list[str] | None, typer.Option(metavar="NAME=LOW:HIGH")] = None,
    iterations: int | None = None,
    start_count: Annotated[int | None, typer.Option(min=1)] = None,
    name: JobName = None,
    accept_changes: AcceptChanges = False,
    idempotency_key: str | None = None,
    priority: Priority = 0,
    notify: Notify = None,
    *,
    jobs: Jobs,
) -> Printed:
    """Queue a job that starts with iterations of another; omitted options keep its values.

    Args:
        from_iteration: First iteration of the fork itself, counted from 0 as in `history`;
            iterations 0 to K-1 are copied.
        preference: Weighting of objectives: A, B, C, chapter-3, or JSON.
        optimizer: Search method; `gaitswarm optimizers` lists all.
        optimizer_settings: Settings of the method.
        particles: Maximum number of designs per iteration.
        scenarios: Names, numbers or FILE.json, separated by commas.
        bounds: Search this variable within other bounds; repeatable.
        iterations: Total budget, including copied iterations.
        start_count: Start designs if the search cannot be continued. [default: 5]
        idempotency_key: Repeating a key with the same fork creates no second job.
    """
    from gaitswarm.cli.inputs import (
        chosen_robot,
        constraint_choice,
        optimizer_choice,
        preference_choice,
        scenario_data,
        weights_choice,
    )

    values = {
        "preference": None if preference is None else preference_choice(preference),
        "constraints": constraint_choice(constraint, no_worse_than, none=no_constraints),
        "scenario_weights": weights_choice(scenario_weight),
        "scenario_aggregate": scenario_aggregate,
        "optimizer": optimizer_choice(optimizer, optimizer_settings),
        "particles": particles,
        "scenarios": None if scenarios is None else scenario_data(scenarios, robot),
        "robot": None if robot is None else chosen_robot(robot),
        "bounds": dict(name_and_bounds(entry, "bounds") for entry in bounds or ()) or None,
        "iterations": iterations,
        "start_count": start_count,
        "name": name,
        "accept_changes": accept_changes or None,
    }
    options: ForkOptions = {k: v for k, v in values.items() if v is not None}  # type: ignore[assignment]
    job = jobs.fork(
        job_id,
        from_iteration,
        idempotency_key=idempotency_key,
        priority=priority,
        notify_url=notify,
        **options,
    )
    lineage = "" if job.lineage is None else f"{job.state}: {lineage_line(job.lineage)}\n"
    return job, _submitted(job, lineage, jobs.place)


def label(
    job_id: JobId,
    name: Annotated[
        str | None, typer.Option(help="Name to show instead of the spec's; empty restores that.")
    ] = None,
    note: Annotated[str | None, typer.Option(help="Note; empty removes it.")] = None,
    tag: Annotated[
        list[str] | None, typer.Option(help="Tag, replacing all tags; repeatable.")
    ] = None,
    no_tags: Annotated[bool, typer.Option("--no-tags", help="Remove all tags.")] = False,
    archive: Annotated[
        bool | None,
        typer.Option("--archive/--unarchive", help="Hide the job from lists, or show it again."),
    ] = None,
    *,
    jobs: Jobs,
) -> Printed:
    """Name, annotate, tag or archive a job; its spec and results do not change."""
    tags = [] if no_tags else tag or None
    job = jobs.label(job_id, name=name, note=note, tags=tags, archived=archive)
    labels = [f"name {job.name!r}", *(f"tag {word}" for word in job.tags)]
    labels += (["a note"] if job.note else []) + (["archived"] if job.archived else [])
    return job, f"job {job.id}: {', '.join(labels)}"


def delete(
    job_id: JobId,
    yes: Annotated[bool, typer.Option("--yes", "-y", help="Do not ask for confirmation.")] = False,
    undo: Annotated[
        bool, typer.Option("--undo", help="Restore a job deleted in the last 24 hours, by its id.")
    ] = False,
    *,
    jobs: Jobs,
) -> None:
    """Delete an ended or paused job with all its results; --undo restores it for 24 hours."""
    if undo:
        print_text(f"job {jobs.restore(job_id).id} is restored")
        return
    if not yes:
        note(_loss(jobs, jobs.job(job_id)))
        if not sys.stdin.isatty():
            raise InvalidRequest("not a terminal: pass --yes to confirm", field="yes")
        if not typer.confirm("Delete it?", err=True):
            note("nothing was deleted")
            return
    jobs.delete(job_id)
    print_text(f"job {job_id} is deleted")
    note(f"to restore it within 24 hours, run: gaitswarm delete --undo {job_id}{jobs.place}")


def _loss(jobs: Jobs, job: JobView) -> str:
    """Describe what deletion removes, and what remains."""
    forks = sum(1 for _ in jobs.jobs(parent=job.id))
    name = f" ({job.name})" if job.name else ""
    loss = (
        f"job {job.id}{name} is {job.state}; deletion removes {job.iterations} iterations with"
        f" {job.evaluations} evaluated designs after 24 hours"
    )
    if forks:
        loss += f"\nforks that keep their copies of its iterations: {forks}"
    return f"{loss}\ncertificates of its designs remain"


def keep(
    job_id: JobId,
    release: Annotated[bool, typer.Option("--release", help="Allow deletion again.")] = False,
    *,
    jobs: Jobs,
) -> Printed:
    """Protect a job from deletion."""
    job = jobs.release(job_id) if release else jobs.keep(job_id)
    return job, f"job {job.id} {'is kept' if job.kept else 'is no longer kept'}"


def optimize(
    options: SpecOptions,
    *,
    resume: Annotated[str | None, typer.Option(metavar="ID", callback=completed)] = None,
    accept_changes: AcceptChanges = False,
    workers: WorkerOptions,
    as_json: Json = False,
) -> None:
    """Run a job in this process. Ctrl-C stops it; --resume continues it.

    Args:
        resume: Resume this job; results equal those of an uninterrupted run to the bit.
    """
    from gaitswarm.cli.embedded import Embedded, finish
    from gaitswarm.cli.inputs import build_spec

    if accept_changes and resume is None:
        raise InvalidRequest("requires --resume", field="accept-changes")
    spec = build_spec(options) if resume is None or options.given else None
    with closing(Embedded(workers, accepts_changes=accept_changes)) as embedded:
        jobs, claim = embedded.jobs, None
        if spec is not None and resume is None:
            claim = embedded.service.submit_embedded(spec)
            job = claim.job
        else:
            job = embedded.resumed(resume or "", spec)
        note(f"job {job.id} in database {embedded.database}")
        interrupted = embedded.run(job, claim)
        finish(jobs, job.id, interrupted, as_json=as_json)
