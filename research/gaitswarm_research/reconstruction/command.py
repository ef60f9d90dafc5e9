"""`gaitswarm-research reconstruction`."""

from __future__ import annotations

import os
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Annotated

import typer

import gaitswarm
from gaitswarm import InvalidRequest
from gaitswarm_research import options
from gaitswarm_research.reconstruction.conventions import alternatives
from gaitswarm_research.reconstruction.deviations import deviations
from gaitswarm_research.reconstruction.evidence import gather
from gaitswarm_research.reconstruction.report import write_report
from gaitswarm_research.reconstruction.targets import Size, calibrations


def reconstruction(
    *,
    output: Annotated[Path, typer.Option(help="Folder of the report, created if missing.")] = Path(
        "reconstruction"
    ),
    seeds: Annotated[int, typer.Option(min=1, max=32, help="Number of calibrations.")] = 3,
    particles: Annotated[
        int | None, typer.Option(min=2, help="Designs per iteration. Default: 40.")
    ] = None,
    iterations: Annotated[
        int | None, typer.Option(min=1, help="Iterations of each calibration. Default: 50.")
    ] = None,
    samples: Annotated[
        int | None,
        typer.Option(
            min=1,
            help="Random designs under the default and the best of each calibration, and five times"
            " as few under every other choice. Default: 1000.",
        ),
    ] = None,
    quick: Annotated[
        bool, typer.Option("--quick", help="Use the defaults 12, 8 and 100 instead.")
    ] = False,
    change: Annotated[
        str | None,
        typer.Option(
            metavar="NAME,...",
            help="Conventions to change one at a time from the default. Default: all.",
        ),
    ] = None,
    only_deviations: Annotated[
        bool,
        typer.Option("--deviations", help="Only compare the default model with print, in seconds."),
    ] = False,
    db: options.Db = None,
    cpus: options.Cpus = None,
    ray_address: options.RayAddress = None,
) -> None:
    """Search the conventions that the thesis leaves open, and report what the evidence decides.

    Calibrations are jobs of the database; results of random designs are kept in the output folder.
    Results of the same code are reused, so the same command resumes an interrupted run.
    """
    if only_deviations:
        typer.echo(deviations())
        return
    defaults = (12, 8, 100) if quick else (40, 50, 1000)
    n_particles, n_iterations, n_samples = (
        default if value is None else value
        for value, default in zip((particles, iterations, samples), defaults, strict=True)
    )
    size = Size(seeds, n_particles, n_iterations, n_samples, samples_each=max(1, n_samples // 5))
    specs = calibrations(size)
    changed = None if change is None else [name.strip() for name in change.split(",")]
    alternatives(specs[0], changed)
    try:
        output.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InvalidRequest(f"cannot create {output}: {error.strerror}", field="output") from error
    calibrated = [options.run_job(s, db=db, cpus=cpus, ray_address=ray_address).job for s in specs]

    def announce(index: int, count: int, label: str) -> None:
        options.stderr.print(f"random designs, choice {index + 1} of {count}: {label}")

    with gaitswarm.open(db) as jobs, ThreadPoolExecutor(cpus or os.cpu_count()) as threads:
        evidence = gather(specs[0], jobs, calibrated, size, output, threads, changed, announce)
    typer.echo(write_report(output, evidence))
