"""Output: results to stdout or to files, everything else to stderr."""

from __future__ import annotations

import os
import sys
import warnings
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any, TextIO

from gaitswarm.cli.exit_codes import OutputFailed
from gaitswarm.services.optimizer.errors import InvalidRequest

if TYPE_CHECKING:
    from pydantic import BaseModel
    from rich.console import Console
    from rich.table import Table


class OutputClosed(Exception):
    """The reader of standard output closed it, as `head` does."""


def print_table(table: Table) -> None:
    """Print a table without cutting words; the terminal wraps lines that are too long."""
    from rich.console import Console
    from rich.measure import Measurement

    console = Console(file=sys.stdout, highlight=False, markup=False, emoji=False, soft_wrap=True)
    wide = console.options.update(width=1000)
    for column in table.columns:
        cells = (column.header, *column.cells)
        column.min_width = max(Measurement.get(console, wide, cell).minimum for cell in cells)
    console.print(table)


def stderr_console() -> Console:
    from rich.console import Console

    return Console(file=sys.stderr, highlight=False)


def note(message: str) -> None:
    """Print a line to stderr; it is lost if stderr cannot be written."""
    try:
        sys.stderr.write(f"{message}\n")
        sys.stderr.flush()
    except OSError:
        discard(sys.stderr)


def print_text(text: str) -> None:
    sys.stdout.write(f"{text}\n")


Parts = Iterator[Any]
"""Texts and tables that a command prints."""

Printed = tuple[Any, Iterable[Any] | str]
"""Result of a command: a document for --json, and otherwise texts and tables.

The document is an iterator of models, or what Pydantic can serialize.
"""


def show(document: Any, parts: Iterable[Any] | str, *, as_json: bool) -> None:
    """Print a document with bit-exact floats, or text and tables, which are made only then."""
    if as_json:
        print_document(document)
        return
    for part in [parts] if isinstance(parts, str) else parts:
        if isinstance(part, str):
            print_text(part)
        else:
            print_table(part)


def print_document(document: Any) -> None:
    """Print JSON; an iterator of models becomes an array while they are read."""
    if isinstance(document, Iterator):
        write_json_items(sys.stdout, document)
        sys.stdout.write("\n")
    else:
        from pydantic_core import to_json

        print_text(to_json(document, indent=2, inf_nan_mode="null").decode())


def write_json_items(out: TextIO, views: Iterable[BaseModel], *, indent: int = 0) -> None:
    """Write a JSON array with one view per line."""
    separator = "\n"
    margin = " " * indent
    out.write("[")
    for view in views:
        out.write(f"{separator}{margin}  {view.model_dump_json()}")
        separator = ",\n"
    out.write("]" if separator == "\n" else f"\n{margin}]")


def warnings_as_notes() -> None:
    """Print Python's warnings as notes, without source lines."""

    def show(message: Warning | str, *_where: object, **_more: object) -> None:
        note(f"warning: {message}")

    warnings.showwarning = show


class Stdout:
    """Standard output that raises OutputFailed or OutputClosed, unlike other files."""

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream

    def write(self, text: str) -> int:
        # Typer probes the stream by an empty write, and interprets a failure.
        if text == "":
            return 0
        with self._distinct_failures():
            return self._stream.write(text)

    def flush(self) -> None:
        with self._distinct_failures():
            self._stream.flush()

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)

    @contextmanager
    def _distinct_failures(self) -> Iterator[None]:
        try:
            yield
        except BrokenPipeError as error:
            discard(self._stream)
            raise OutputClosed from error
        except OSError as error:
            discard(self._stream)
            raise OutputFailed(f"standard output cannot be written: {error.strerror}") from error


def replace_closed_streams() -> None:
    """Open the null device for standard streams closed at start, as by `>&-`."""
    for name, mode in (("stdin", "r"), ("stdout", "w"), ("stderr", "w")):
        if getattr(sys, name) is None:
            setattr(sys, name, Path(os.devnull).open(mode, encoding="utf-8"))  # noqa: SIM115


def discard(stream: TextIO) -> None:
    """Redirect a broken stream to the null device: the interpreter flushes it at exit."""
    with suppress(OSError, ValueError):
        null = os.open(os.devnull, os.O_WRONLY)
        os.dup2(null, stream.fileno())
        os.close(null)


@contextmanager
def replacing(path: Path, option: str) -> Iterator[IO[bytes]]:
    """Open a binary file that replaces the path, or a link's target, when the block succeeds."""
    import tempfile

    try:
        special = path.exists() and not path.is_file()
        target = path.resolve()
    except (OSError, RuntimeError) as error:  # RuntimeError: circular links, before Python 3.13
        reason = getattr(error, "strerror", None) or "its links are circular"
        raise InvalidRequest(f"cannot write {path}: {reason}", field=option) from error
    try:
        if special:
            with path.open("wb") as file:
                yield file
            return
        descriptor, name = tempfile.mkstemp(dir=target.parent, prefix=f".{target.name}.")
        temporary = Path(name)
        try:
            with os.fdopen(descriptor, "wb") as file:
                yield file
            # mkstemp creates files that only their owner can read.
            umask = os.umask(0)
            os.umask(umask)
            temporary.chmod(0o666 & ~umask)
            temporary.replace(target)
        finally:
            temporary.unlink(missing_ok=True)
    except OSError as error:
        raise InvalidRequest(f"cannot write {path}: {error.strerror}", field=option) from error
