"""The `gaitswarm` command line.

Commands import their dependencies when they run, so that `gaitswarm --help` is fast.
"""

from __future__ import annotations

import gc
import os
import re
import sys
import traceback
from collections.abc import Callable, Sequence
from contextlib import redirect_stdout
from copy import copy
from functools import cache
from importlib import import_module
from typing import Annotated, Any, Final, TextIO, cast

import typer
from typer.core import TyperGroup
from typer.main import get_command

from gaitswarm.cli.exit_codes import ExitCode, exit_code, explanation
from gaitswarm.cli.options import expanded
from gaitswarm.cli.output import (
    OutputClosed,
    Stdout,
    note,
    replace_closed_streams,
    warnings_as_notes,
)

_GROUPS: Final = {
    "robot": ("Create a robot from a URDF file, and check it.", "robot.init robot.check"),
    "plot": (
        "Draw a job's convergence or front, or a controller's surface.",
        "plot.convergence plot.front plot.surface",
    ),
    "token": (
        "Create, list and revoke tokens for access to a server.",
        "administration.create administration.list_tokens administration.revoke",
    ),
    "db": (
        "Upgrade, check, back up, restore and prune the database.",
        (
            "administration.upgrade administration.check administration.backup"
            " administration.restore administration.prune"
        ),
    ),
}
"""Help texts and commands of groups."""

_PANELS: Final = {
    "Start here": "jobs.optimize serve.serve jobs.submit jobs.list_jobs jobs.status jobs.best"
    " designs.simulate robot",
    "Jobs": "jobs.watch jobs.history jobs.pause jobs.resume jobs.extend jobs.prioritize jobs.cancel"
    " jobs.fork jobs.label jobs.keep jobs.delete jobs.diff serve.runner",
    "Analysis of jobs": "analysis.verdict analysis.rank analysis.front analysis.importance"
    " analysis.failures analysis.preferences plot evidence.export evidence.evidence"
    " evidence.verify",
    "Designs": "certify.certify designs.robustness designs.firmware designs.trajectories",
    "Robots and measurements": "robot.gaits robot.mjcf measurements.record measurements.recordings"
    " measurements.identify measurements.parameters measurements.calibrate measurements.targets"
    " measurements.validate",
    "Installation": "administration.optimizers administration.cases administration.plugins token"
    " administration.audit db",
}
"""Commands, each a module and its function, and groups in the order of the help text."""


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
        panels = {panel: list(map(_name, text.split())) for panel, text in _PANELS.items()}
        if "optimize" not in commands:
            panels = {"Commands": list(commands)}
        for panel, names in panels.items():
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


_app = typer.Typer(
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


@_app.callback()
def _root(
    _: Annotated[
        bool,
        typer.Option(
            "--version", callback=_print_version, is_eager=True, help="Show the version and exit."
        ),
    ] = False,
) -> None:
    """Find robust drive controllers for walking robots."""


def main() -> None:
    # Collections during imports take a sixth of a short command's time; `expanded` enables them.
    gc.disable()
    # Looking for plug-ins of pydantic reads the metadata of every installed package.
    os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "__all__")
    replace_closed_streams()
    warnings_as_notes()
    sys.exit(run(sys.argv[1:]))


@cache
def commands(only: str | None = None) -> Callable[..., object]:
    """Build one command, or all: building all takes longer than most of them run."""
    every = {_name(entry): entry for text in _PANELS.values() for entry in text.split()}
    app = copy(_app)
    app.registered_commands, app.registered_groups = [], []
    for name, entry in {only: every[only]}.items() if only in every else every.items():
        if entry in _GROUPS:
            text, members = _GROUPS[entry]
            group = typer.Typer(help=text)
            for command in members.split():
                group.command(_name(command))(_function(command))
            app.add_typer(group, name=entry)
        else:
            app.command(name)(_function(entry))
    return get_command(app)


def _name(entry: str) -> str:
    return re.sub("_(jobs|tokens)$", "", entry.rpartition(".")[2])


def _function(entry: str) -> Callable[..., None]:
    module, _, name = entry.partition(".")
    return expanded(getattr(import_module(f"gaitswarm.cli.commands.{module}"), name))


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
