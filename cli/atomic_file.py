"""Files that are there in full, or not at all."""

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
    """A binary file that takes the path's place when the block ends without an exception.

    A link stays, and what it points to is replaced; a device or pipe stays, and is written to.

    option: which option named the path, for the message of InvalidRequest if it cannot be written.
    """
    try:
        special = path.exists() and not path.is_file()
        target = path.resolve()
    except (OSError, RuntimeError) as error:  # RuntimeError: links in a circle, before Python 3.13
        reason = getattr(error, "strerror", None) or "its links lead in a circle"
        raise InvalidRequest(f"cannot write {path}: {reason}", field=option) from error
    if special:
        try:
            with path.open("wb") as file:
                yield file
        except OSError as error:
            raise InvalidRequest(f"cannot write {path}: {error.strerror}", field=option) from error
        return
    try:
        descriptor, name = tempfile.mkstemp(dir=target.parent, prefix=f".{target.name}.")
    except OSError as error:
        raise InvalidRequest(f"cannot write {path}: {error.strerror}", field=option) from error
    temporary = Path(name)
    try:
        with os.fdopen(descriptor, "wb") as file:
            yield file
        # mkstemp makes files that only their owner may read.
        umask = os.umask(0)
        os.umask(umask)
        temporary.chmod(0o666 & ~umask)
        temporary.replace(target)
    except OSError as error:
        raise InvalidRequest(f"cannot write {path}: {error.strerror}", field=option) from error
    finally:
        temporary.unlink(missing_ok=True)
