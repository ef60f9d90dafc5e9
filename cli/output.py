"""Where output goes: results to stdout, everything else to stderr."""

from __future__ import annotations

import os
import sys
import warnings
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any, TextIO

from gaitswarm.cli.exit_codes import OutputFailed

if TYPE_CHECKING:
    from pydantic import BaseModel
    from rich.console import Console


class OutputClosed(Exception):
    """Whoever read standard output has seen enough, as `head` has."""


def stdout_console() -> Console:
    """For tables and sentences that are the command's result."""
    from rich.console import Console

    return Console(file=sys.stdout, highlight=False, soft_wrap=True)


def stderr_console() -> Console:
    """For progress and remarks."""
    from rich.console import Console

    return Console(file=sys.stderr, highlight=False)


def note(message: str) -> None:
    """One line for the user that is no part of the result; lost where stderr cannot be written."""
    try:
        sys.stderr.write(f"{message}\n")
        sys.stderr.flush()
    except OSError:
        discard(sys.stderr)


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


class Stdout:
    """Standard output whose failures are not mistaken for those of any other file."""

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream

    def write(self, text: str) -> int:
        """As of a text stream. Raises OutputFailed, OutputClosed."""
        # Typer writes no text to find out what stream it is, and takes a failure for an answer.
        if text == "":
            return 0
        with self._telling_failures():
            return self._stream.write(text)

    def flush(self) -> None:
        """As of a text stream. Raises OutputFailed, OutputClosed."""
        with self._telling_failures():
            self._stream.flush()

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)

    @contextmanager
    def _telling_failures(self) -> Iterator[None]:
        try:
            yield
        except BrokenPipeError as error:
            discard(self._stream)
            raise OutputClosed from error
        except OSError as error:
            discard(self._stream)
            raise OutputFailed(f"standard output cannot be written: {error.strerror}") from error


def replace_closed_streams() -> None:
    """Give a process that was started without some standard streams, as by `>&-`, empty ones.

    Their numbers would go to the next files that are opened.
    """
    for name, mode in (("stdin", "r"), ("stdout", "w"), ("stderr", "w")):
        if getattr(sys, name) is None:
            setattr(sys, name, Path(os.devnull).open(mode, encoding="utf-8"))  # noqa: SIM115


def discard(stream: TextIO) -> None:
    """Let a stream that cannot be written swallow all: the interpreter flushes it at its end."""
    with suppress(OSError, ValueError):
        null = os.open(os.devnull, os.O_WRONLY)
        os.dup2(null, stream.fileno())
        os.close(null)
