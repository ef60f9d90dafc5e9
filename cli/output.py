"""Where output goes: results to stdout, everything else to stderr."""

from __future__ import annotations

import logging
import sys
import warnings
from collections.abc import Iterable
from contextlib import suppress
from typing import TYPE_CHECKING, TextIO

if TYPE_CHECKING:
    from pydantic import BaseModel
    from rich.console import Console


def stdout_console() -> Console:
    """For tables and sentences that are the command's result."""
    from rich.console import Console

    return Console(file=sys.stdout, highlight=False, soft_wrap=True)


def stderr_console() -> Console:
    """For progress and remarks."""
    from rich.console import Console

    return Console(file=sys.stderr, highlight=False)


def note(message: str) -> None:
    """One line for the user that is no part of the result."""
    sys.stderr.write(f"{message}\n")
    sys.stderr.flush()


def print_text(text: str) -> None:
    """The result, as it is."""
    sys.stdout.write(f"{text}\n")


def print_json(view: BaseModel) -> None:
    """One JSON document; floats exact to the bit, null for what is not finite."""
    print_text(view.model_dump_json(indent=2))


def print_json_list(views: Iterable[BaseModel]) -> None:
    """A JSON array, written as the views come."""
    write_json_items(sys.stdout, views)
    sys.stdout.write("\n")


def write_json_items(out: TextIO, views: Iterable[BaseModel], *, indent: int = 0) -> None:
    """`[...]`, one view a line."""
    separator = "\n"
    margin = " " * indent
    out.write("[")
    for view in views:
        out.write(f"{separator}{margin}  {view.model_dump_json()}")
        separator = ",\n"
    out.write("]" if separator == "\n" else f"\n{margin}]")


def warnings_as_notes() -> None:
    """Show Python's warnings as remarks, without the source line that raised them."""

    def show(message: Warning | str, *_where: object, **_more: object) -> None:
        note(f"warning: {message}")

    warnings.showwarning = show


def log_to_stderr(level: str) -> None:
    """Show what a long-running process logs, from a level such as "INFO" on."""
    logging.basicConfig(
        stream=sys.stderr, level=level, format="%(asctime)s %(levelname)s %(message)s"
    )
    # Every start would tell of migrations that are already done.
    logging.getLogger("alembic").setLevel(logging.WARNING)


def discard_stdout() -> None:
    """After the reader of a pipe has gone: let the interpreter's last flush not fail."""
    import os

    with suppress(OSError, ValueError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
