"""`gaitswarm-research`: the command line."""

from __future__ import annotations

import sys

import typer

app = typer.Typer(
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)


@app.callback()
def research() -> None:
    """Compare search methods, reconstruct published results, and study the model."""


def main() -> None:
    """Run the command line. An error of gaitswarm is shown without a traceback."""
    from gaitswarm import GaitswarmError

    try:
        app()
    except GaitswarmError as error:
        typer.echo(f"error: {error}", err=True)
        sys.exit(2)


if __name__ == "__main__":
    main()
