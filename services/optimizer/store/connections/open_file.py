"""Detection of a database file that is removed or replaced while it is open."""

from __future__ import annotations

import threading
from pathlib import Path
from typing import Any, Final

from sqlalchemy import Engine, event

from gaitswarm.services.optimizer.errors import StoreReplaced

_COUNTED: Final = "counted as open"

_Identity = tuple[int, int]
"""Device and inode."""


class OpenFile:
    """Identities of an SQLite file and of its write-ahead log, while connections are open.

    SQLite removes the log when the last connection of all processes is closed, and makes another
    when the next one is opened. As long as one is open both files stay, also through checkpoints,
    VACUUM and a restored backup: another inode at either path is another file, in which nothing is
    found of what is written here.

    Args:
        path: Of the file.
        name: By which messages call it.
        engine: Of which all connections count.
    """

    def __init__(self, path: str, name: str, engine: Engine) -> None:
        self._file = Path(path).absolute()
        self._log = self._file
        self._name = name
        self._lock = threading.Lock()
        self._connections = 0
        self._file_identity: _Identity | None = None
        self._log_identity: _Identity | None = None
        """None until the log is made, which the first transaction does."""
        event.listen(engine, "do_connect", self._before_connection)
        event.listen(engine, "checkout", self._opened)
        event.listen(engine, "close", self._closed)

    def check(self) -> None:
        """Compare the files with those that are open.

        Raises:
            StoreReplaced: Either was removed or replaced.
        """
        with self._lock:
            if not self._connections:
                return
            file, log = self._present()
            if self._log_identity is None:
                self._log_identity = log
            if (file, log) == (self._file_identity, self._log_identity):
                return
        raise StoreReplaced(
            f"database {self._name}: the database file was removed or replaced while it was open;"
            " restart the server or command that uses it, and restore a backup if jobs are missing"
        )

    def _before_connection(self, *_: object) -> None:
        # SQLite would make an empty file in place of one that is gone.
        self.check()

    def _opened(self, _connection: object, record: Any, _proxy: object) -> None:
        if record.info.get(_COUNTED):
            return
        record.info[_COUNTED] = True
        with self._lock:
            self._connections += 1
            if self._connections == 1:
                # SQLite follows links, and keeps its log next to the target.
                real = self._file.resolve()
                self._log = real.with_name(f"{real.name}-wal")
                self._file_identity, self._log_identity = self._present()

    def _closed(self, _connection: object, record: Any) -> None:
        if record.info.pop(_COUNTED, False):
            with self._lock:
                self._connections -= 1

    def _present(self) -> tuple[_Identity | None, _Identity | None]:
        return _identity(self._file), _identity(self._log)


def _identity(path: Path) -> _Identity | None:
    try:
        status = path.stat()
    except OSError:
        return None
    return status.st_dev, status.st_ino
