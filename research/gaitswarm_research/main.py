"""`gaitswarm-research`: the command line."""

from __future__ import annotations

import sys

import typer
from pydantic import ValidationError

from gaitswarm import GaitswarmError, Interrupted
from gaitswarm.plugins import SimulationInputError
from gaitswarm_research.compare.bbob import bbob
from gaitswarm_research.compare.command import compare
from gaitswarm_research.reconstruction.command import reconstruction
from gaitswarm_research.studies.accuracy import noise, steps, tables
from gaitswarm_research.studies.constraints import constraints
from gaitswarm_research.studies.controllers import controllers
from gaitswarm_research.studies.drives import drives
from gaitswarm_research.studies.precision import precision
from gaitswarm_research.studies.worlds import worlds

app = typer.Typer(
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)


@app.callback()
def research() -> None:
    """Compare search methods, reconstruct published results, and study the model."""


app.command()(compare)
app.command()(bbob)
app.command()(reconstruction)
study = typer.Typer(
    no_args_is_help=True,
    help="Measure effects of tables, time steps, noise, precision, controllers, worlds, drives"
    " and constraints.",
)
for command in (
    tables,
    steps,
    noise,
    precision,
    controllers,
    worlds,
    drives,
    constraints,
):
    study.command()(command)
app.add_typer(study, name="study")


def main() -> None:
    """Run the command line. An error of gaitswarm is shown without a traceback."""
    try:
        app()
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        field = ".".join(map(str, first["loc"]))
        typer.echo(f"error: {field}: {first['msg']}", err=True)
        sys.exit(2)
    except (GaitswarmError, SimulationInputError) as error:
        typer.echo(f"error: {error}", err=True)
        sys.exit(2)
    except Interrupted as interruption:
        typer.echo(f"interrupted; the same command resumes: {interruption}", err=True)
        sys.exit(130)


if __name__ == "__main__":
    main()
