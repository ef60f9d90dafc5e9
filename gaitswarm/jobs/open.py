"""Which jobs a command means, and the way to them."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from services.optimizer.errors import InvalidRequest, NotFound

if TYPE_CHECKING:
    from gaitswarm.jobs.port import Jobs


def database_url(db: str | None) -> str:
    """The database that was named by option or environment, else the user's own.

    Makes the directory of the user's own database, and only that.
    """
    from gaitswarm.settings import CliSettings, default_database

    named = db or CliSettings().db
    if named:
        return named
    path = default_database()
    path.parent.mkdir(parents=True, exist_ok=True)
    return str(path)


def open_jobs(server: str | None, db: str | None, *, create: bool = False) -> Jobs:
    """An option goes before the environment, the server before the database.

    create: whether an SQLite file that is not there is made; else it is NotFound.
    """
    from gaitswarm.settings import CliSettings

    if server and db:
        raise InvalidRequest("jobs are either on a server or in a database", field="--server, --db")
    server = server or (None if db else CliSettings().server)
    if server:
        from gaitswarm.jobs.remote import RemoteJobs

        return RemoteJobs(server)

    from gaitswarm.jobs.local import LocalJobs
    from services.optimizer.service import JobService
    from services.runtime import open_store

    url = database_url(db)
    file = _sqlite_file(url)
    if file is not None and not create and not file.exists():
        raise NotFound(
            f"there is no database {file} yet; `gaitswarm optimize` makes it with its first job,"
            " and --db or --server names another place"
        )
    return LocalJobs(JobService(open_store(url)), url)


def _sqlite_file(url: str) -> Path | None:
    scheme, separator, rest = url.partition("://")
    if not separator:
        return Path(url).expanduser()
    if scheme.split("+")[0] != "sqlite":
        return None
    return Path(rest.removeprefix("/").partition("?")[0]).expanduser()
