"""`gaitswarm plot`: pictures of convergence, fronts and controllers."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from gaitswarm.cli.options import JobId, Place

if TYPE_CHECKING:
    from gaitswarm.jobs.base import Jobs

Output = Annotated[
    Path, typer.Option("--output", "-o", metavar="FILE", help="FILE.png, .svg or .pdf.")
]


def convergence(job_id: JobId, output: Output, *, jobs: Jobs) -> None:
    """Draw a job's fitness over its iterations."""
    from gaitswarm.cli.pictures import save
    from gaitswarm.evidence.archive import draw_convergence

    job, iterations = jobs.job(job_id), list(jobs.iterations(job_id))
    save(draw_convergence(iterations, title=job.name or f"job {job.id}"), output)


def front(job_id: JobId, output: Output, *, jobs: Jobs) -> None:
    """Draw the Pareto front of a job in every pair of objectives, with its knees and winners."""
    from gaitswarm.cli.pictures import draw_front, save

    job, view = jobs.job(job_id), jobs.front(job_id, most=10_000)
    save(draw_front(view, title=f"Pareto front of {job.name or f'job {job.id}'}"), output)


def surface(
    output: Output,
    design: Annotated[str, typer.Option(metavar="JSON|FILE|published:NAME|job:ID")] = "published:A",
    *,
    place: Place,
) -> None:
    """Draw the quantised output of a Fuzzy-PI design over angle error and motor current.

    Args:
        design: Design as for `simulate`, or as published:A.
    """
    from gaitswarm.cli.inputs import given_design
    from gaitswarm.cli.pictures import draw_surface, save
    from gaitswarm.sim.controllers import CONTROLLERS
    from gaitswarm.sim.controllers.surface import surface as surface_of

    given = given_design(design, "fuzzy-pi", place=place)
    (inference,) = CONTROLLERS["fuzzy-pi"].inferences(given.values)
    drawn = surface_of(inference, error_points=129, current_points=65)
    save(draw_surface(drawn, title=f"Fuzzy-P of {given.label}"), output)
