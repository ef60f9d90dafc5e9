"""The real parser of `gaitswarm`, to check written commands against."""

from __future__ import annotations

import re
from collections.abc import Sequence
from contextlib import redirect_stdout
from functools import cache
from io import StringIO
from typing import Any

import typer

from gaitswarm.cli import main


@cache
def commands() -> dict[str, set[str]]:
    """Options of every command, by its full name."""
    return {name: _options(command) for name, command in _leaves(_root(), "")}


def taking(metavar: str) -> set[str]:
    """Full names of the commands with an argument or option of a metavar, a regular expression."""
    return {
        name
        for name, command in _leaves(_root(), "")
        if any(re.search(metavar, str(parameter.metavar)) for parameter in command.params)
    }


def problem(arguments: Sequence[str]) -> str | None:
    """What is wrong with a written command; None if it could be run."""
    known = commands()
    words = [word for word in arguments if not word.startswith("-")]
    if not words or words[0] == "COMMAND" or words == ["plot"]:
        return None
    name = next((n for n in (" ".join(words[:2]), " ".join(words[:1])) if n in known), None)
    if name is None:
        return f"no command {' '.join(words[:2])!r}"
    options = [word.partition("=")[0] for word in arguments if word.startswith("-") and word != "-"]
    unknown = [option for option in options if option not in known[name]]
    return f"{name} has no option {', '.join(unknown)}" if unknown else None


def refusal(arguments: Sequence[str]) -> str | None:
    """What the command line says against a command, which is not run; None if it takes it.

    Arguments and options are converted and checked as in a run: their number, kinds and choices.
    Ids have to be in full, as the beginning of one is looked up.
    """
    command, context, rest = _root(), None, list(arguments)
    name = "gaitswarm"
    while rest and rest[0] in getattr(command, "commands", {}):
        context = typer.Context(command, parent=context, info_name=name)
        name, rest = rest[0], rest[1:]
        command = command.commands[name]
    if rest and hasattr(command, "commands") and not rest[0].startswith("-"):
        return f"no command {rest[0]!r}"
    try:
        with redirect_stdout(StringIO()):
            command.make_context(name, rest, parent=context)
    except typer.Exit:
        return None
    except Exception as error:  # noqa: BLE001 - whatever it is, it is said against the command
        return str(getattr(error, "message", error)) or repr(error)
    return None


@cache
def _root() -> Any:
    return main.commands()


def _leaves(command: Any, prefix: str) -> list[tuple[str, Any]]:
    """(full name, command) of every command that is no group of some."""
    children = getattr(command, "commands", None)
    if children is None:
        return [(prefix.strip(), command)]
    return [leaf for name, child in children.items() for leaf in _leaves(child, f"{prefix} {name}")]


def _options(command: Any) -> set[str]:
    named = (option for p in command.params for option in (*p.opts, *p.secondary_opts))
    return {*named, "--help", "-h"}
