"""Atomic replacement of output files."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO

from gaitswarm.services.optimizer.errors import InvalidRequest


@contextmanager
def replacing(path: Path, option: str) -> Iterator[IO[bytes]]:
    """Open a binary file that replaces the path, or a link's target, when the block succeeds."""
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
