"""The real parser of `gaitswarm`, to check written commands against."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from typing import Any

import typer

from cli.main import app


@cache
def commands() -> dict[str, set[str]]:
    """Options of every command, by its full name."""
    return dict(_leaves(typer.main.get_command(app), ""))


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


def _leaves(command: Any, prefix: str) -> list[tuple[str, set[str]]]:
    children = getattr(command, "commands", None)
    if children is None:
        options = {
            option
            for parameter in command.params
            for option in (*parameter.opts, *parameter.secondary_opts)
        }
        return [(prefix.strip(), options | {"--help", "-h"})]
    return [leaf for name, child in children.items() for leaf in _leaves(child, f"{prefix} {name}")]
