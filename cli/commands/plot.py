"""`gaitswarm plot`: pictures of a job's convergence and of a fuzzy controller's surface."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from cli.options import Db, JobId, Server

Output = Annotated[
    Path, typer.Option("--output", "-o", metavar="FILE", help="FILE.png, .svg or .pdf.")
]


def register(app: typer.Typer) -> None:
    """Add the group of commands."""
    plots = typer.Typer(help="Draw a job's convergence or a controller's surface.")
    plots.command()(convergence)
    plots.command()(surface)
    app.add_typer(plots, name="plot")


def convergence(job_id: JobId, output: Output, server: Server = None, db: Db = None) -> None:
    """Draw a job's fitness over its iterations: best so far, and its designs."""
    from cli.output import note
    from cli.plots import draw_convergence, save
    from gaitswarm.jobs.open import open_jobs

    with open_jobs(server, db) as jobs:
        job = jobs.job(job_id)
        iterations = list(jobs.iterations(job_id))
    save(draw_convergence(iterations, title=job.name or f"job {job.id}"), output)
    note(f"picture written to {output}")


def surface(
    output: Output,
    design: Annotated[
        str,
        typer.Option(
            metavar="FILE|published:NAME", help="Design as for `simulate`, or as published:A."
        ),
    ] = "published:A",
) -> None:
    """Draw the output of a Fuzzy-PI design over angle error and motor current, as quantised."""
    from cli.design_file import read_design
    from cli.output import note
    from cli.plots import draw_surface, save
    from sim.controllers import CONTROLLERS
    from sim.controllers.surface import surface as surface_of

    (inference,) = CONTROLLERS["fuzzy-pi"].inferences(read_design(design, "fuzzy-pi"))
    title = f"Fuzzy-P of design {design.rpartition(':')[2] if ':' in design else Path(design).stem}"
    drawn = surface_of(inference, error_points=129, current_points=65)
    save(draw_surface(drawn, title=title), output)
    note(f"picture written to {output}")
