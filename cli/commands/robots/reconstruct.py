"""`gaitswarm reconstruct`: which of the thesis's open conventions make its own tables come out."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from gaitswarm.cli.inputs.options import WorkerOptions, with_groups

if TYPE_CHECKING:
    from gaitswarm.services.optimizer.jobs.columns import EvaluationColumns
    from gaitswarm.services.optimizer.jobs.kinds.calibration import CalibrationSpec


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command()(reconstruct)


@with_groups
def reconstruct(
    *,
    output: Annotated[
        Path, typer.Option(help="Folder of the report; made if there is none.")
    ] = Path("reconstruction"),
    seeds: Annotated[int, typer.Option(min=1, max=32, help="Calibrations.")] = 3,
    particles: Annotated[
        int | None,
        typer.Option(min=2, help="Designs of an iteration. Default: 40."),
    ] = None,
    iterations: Annotated[
        int | None, typer.Option(min=1, help="Iterations of each calibration. Default: 50.")
    ] = None,
    samples: Annotated[
        int | None,
        typer.Option(
            min=1,
            help="Random designs under the default and the best of each calibration; a fifth of"
            " them under every other choice. Default: 1000.",
        ),
    ] = None,
    quick: Annotated[
        bool, typer.Option("--quick", help="Defaults for a first look: 12, 8 and 100.")
    ] = False,
    change: Annotated[
        str | None,
        typer.Option(
            metavar="NAME,...",
            help="Conventions to change one at a time from the default. Default: all.",
        ),
    ] = None,
    workers: WorkerOptions,
) -> None:
    """Search the conventions that the thesis leaves open, and report what the evidence decides.

    Calibrations are jobs of the database, and results of random designs are kept in the folder.
    What has been computed before, by the same code, is not computed again: what was stopped goes on
    where it was by the same command.
    """
    from concurrent.futures import ThreadPoolExecutor

    from gaitswarm.cli.output import note, print_text
    from gaitswarm.cli.reconstruction.alternatives import alternatives
    from gaitswarm.cli.reconstruction.evidence import gather
    from gaitswarm.cli.reconstruction.plan import Size, calibrations
    from gaitswarm.cli.reconstruction.report import write_report
    from gaitswarm.services.optimizer.errors import InvalidRequest
    from gaitswarm.services.worker.in_process import available_cpus
    from gaitswarm.settings import read_settings

    defaults = (12, 8, 100) if quick else (40, 50, 1000)
    given = (particles, iterations, samples)
    particles_each, budget, random = (
        default if value is None else value for value, default in zip(given, defaults, strict=True)
    )
    size = Size(seeds, particles_each, budget, random, samples_each=max(1, random // 5))
    specs = calibrations(size)
    changed = None if change is None else [name.strip() for name in change.split(",")]
    alternatives(specs[0], changed)
    try:
        output.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InvalidRequest(f"cannot make {output}: {error.strerror}", field="output") from error
    runs = _calibrated(specs, workers)
    cpus = workers.cpus or read_settings().cpus or available_cpus()

    def announce(index: int, count: int, label: str) -> None:
        note(f"random designs, choice {index + 1} of {count}: {label}")

    with ThreadPoolExecutor(cpus) as threads:
        found = gather(specs[0], runs, size, output, threads, changed, announce)
    print_text(str(write_report(output, found)))


def _calibrated(
    specs: tuple[CalibrationSpec, ...], workers: WorkerOptions
) -> list[EvaluationColumns]:
    """All evaluations of every calibration, run unless it was before. Raises as `job_run`."""
    from contextlib import closing
    from dataclasses import asdict

    from gaitswarm.cli.embedded import Embedded, job_run
    from gaitswarm.jobs.database.jobs import DatabaseJobs
    from gaitswarm.jobs.open import database_to_write
    from gaitswarm.services.optimizer.service import JobService
    from gaitswarm.services.runtime import open_store
    from gaitswarm.settings import read_settings

    settings = read_settings(**asdict(workers))
    url = database_to_write(settings)
    with closing(open_store(url)) as store, closing(Embedded(settings)) as embedded:
        service = JobService(store)
        jobs = DatabaseJobs(service, url)
        return [service.columns(job_run(spec, store, jobs, embedded)) for spec in specs]
