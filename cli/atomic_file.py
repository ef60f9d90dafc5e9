"""Files that are there in full, or not at all."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO

from services.optimizer.errors import InvalidRequest


@contextmanager
def replacing(path: Path, option: str) -> Iterator[IO[bytes]]:
    """A binary file that takes the path's place when the block ends without an exception.

    option: which option named the path, for the message of InvalidRequest if it cannot be written.
    """
    try:
        descriptor, name = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
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
        temporary.replace(path)
    except OSError as error:
        raise InvalidRequest(f"cannot write {path}: {error.strerror}", field=option) from error
    finally:
        temporary.unlink(missing_ok=True)
