"""The `gaitswarm` command line.

Commands import their dependencies when they run, so that `gaitswarm --help` is fast.
"""

from __future__ import annotations

import sys
import traceback
from collections.abc import Callable, Sequence
from contextlib import redirect_stdout
from copy import copy
from functools import cache
from typing import Annotated, Any, Final, TextIO, cast

import typer
from typer.core import TyperGroup
from typer.main import get_command, get_command_name
from typer.models import CommandInfo

from gaitswarm.cli.commands import (
    administration,
    analysis,
    bench,
    calibrate,
    certify,
    compare,
    evidence,
    firmware,
    gaits,
    jobs,
    measurements,
    optimize,
    plot,
    robot,
    robustness,
    serve,
    simulate,
)
from gaitswarm.cli.exit_codes import ExitCode, exit_code, explanation
from gaitswarm.cli.output import (
    OutputClosed,
    Stdout,
    note,
    replace_closed_streams,
    warnings_as_notes,
)

PANELS: Final = {
    "Start here": ("optimize", "serve", "submit", "list", "status", "best", "simulate", "robot"),
    "Jobs": (
        *("watch", "history", "pause", "resume", "extend", "prioritize", "cancel", "fork"),
        *("label", "keep", "delete", "diff", "runner"),
    ),
    "Analysis of jobs": (
        *("rank", "front", "importance", "scenarios", "preferences", "plot"),
        *("export", "evidence", "verify"),
    ),
    "Designs": ("compare", "certify", "robustness", "firmware"),
    "Robots and measurements": (
        *("gaits", "mjcf", "record", "recordings", "identify", "parameters"),
        *("calibrate", "targets", "validate", "synthesize"),
    ),
    "Installation": (*("optimizers", "cases", "plugins", "token", "audit", "db", "bench"),),
}
"""Commands in the order of the help text, by heading."""


class _HelpAtOnce(TyperGroup):
    """Show a command's help, untruncated, before parsing options, which imports Pydantic."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        words = args[: args.index("--")] if "--" in args else args
        if not set(words).isdisjoint(ctx.help_option_names):
            command, context = self._command_named(ctx, words)
            if command is not None:
                typer.echo(command.get_help(context), color=ctx.color)
                ctx.exit()
        return list(super().parse_args(ctx, args))

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        commands = {name: self.get_command(ctx, name) for name in self.list_commands(ctx)}
        for panel, names in (PANELS if "optimize" in commands else {"Commands": commands}).items():
            listed = [(name, commands[name]) for name in names if name in commands]
            with formatter.section(panel):
                formatter.write_dl([(name, c.get_short_help_str(1000)) for name, c in listed if c])

    def _command_named(self, context: Any, words: list[str]) -> tuple[Any, Any]:
        """Return the innermost named command and its context; None for an unknown command."""
        command: Any = self
        for word in words:
            if word.startswith("-") or not isinstance(command, TyperGroup):
                break
            command = command.get_command(context, word)
            if command is None:
                break
            context = typer.Context(command, parent=context, info_name=word)
        return command, context


app = typer.Typer(
    name="gaitswarm",
    cls=_HelpAtOnce,
    epilog="Exit codes: 0 done, 1 job failed or cancelled, or a check failed, 2 bad input, 3 not"
    " found, 4 not possible in the job's state, 5 server, database, workers or output unavailable,"
    " 6 permission denied, 70 a bug, 130 interrupted.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    # Importing Rich takes longer than the rest of a help text.
    rich_markup_mode=None,
    context_settings={"help_option_names": ["-h", "--help"]},
)


def _print_version(requested: bool) -> None:
    if requested:
        import gaitswarm

        typer.echo(f"gaitswarm {gaitswarm.__version__}")
        raise typer.Exit


@app.callback()
def _root(
    _: Annotated[
        bool,
        typer.Option(
            "--version", callback=_print_version, is_eager=True, help="Show the version and exit."
        ),
    ] = False,
) -> None:
    """Find robust drive controllers for walking robots."""


for _module in (
    optimize,
    serve,
    jobs,
    evidence,
    administration,
    simulate,
    compare,
    firmware,
    bench,
    analysis,
    robustness,
    plot,
    measurements,
    gaits,
    calibrate,
    certify,
    robot,
):
    _module.register(app)


def main() -> None:
    replace_closed_streams()
    warnings_as_notes()
    sys.exit(run(sys.argv[1:]))


@cache
def commands(only: str | None = None) -> Callable[..., object]:
    """Build one command, or all: building all takes longer than most of them run."""
    alone = copy(app)
    alone.registered_commands = [c for c in app.registered_commands if _name(c) == only]
    alone.registered_groups = [g for g in app.registered_groups if g.name == only]
    exists = alone.registered_commands or alone.registered_groups
    return get_command(alone if exists else app)


def _name(command: CommandInfo) -> str:
    return command.name or get_command_name(cast(Any, command.callback).__name__)


def run(arguments: Sequence[str]) -> int:
    """Run one command and return its exit code; errors go to stderr."""
    stdout = Stdout(sys.stdout)
    with redirect_stdout(cast(TextIO, stdout)):
        command = commands(*arguments[:1])
        code = _exit_code_of(lambda: command(list(arguments), prog_name="gaitswarm"))
        # The interpreter would flush at exit, but could not return an exit code.
        flushed = _exit_code_of(stdout.flush)
    return code or flushed


def _exit_code_of(step: Callable[[], object]) -> int:
    try:
        step()
    except SystemExit as ended:
        if isinstance(ended.__context__, BrokenPipeError):
            # Typer turns it into 1, which here means a failed job.
            return ExitCode.OK
        return ended.code if isinstance(ended.code, int) else int(bool(ended.code))
    except KeyboardInterrupt:
        return ExitCode.INTERRUPTED
    except OutputClosed:
        return ExitCode.OK
    except Exception as error:  # noqa: BLE001 - every error has an exit code
        code = exit_code(error)
        if code is None:
            note(
                f"{traceback.format_exc()}gaitswarm: this is a bug; please report it with the above"
            )
            return ExitCode.BUG
        note(f"gaitswarm: {explanation(error)}")
        return code
    return ExitCode.OK
