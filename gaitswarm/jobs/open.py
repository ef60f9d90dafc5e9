"""The way to jobs: in a database, behind a server, or wherever options and environment say."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from gaitswarm.errors import InvalidRequest, NotFound, StoreUnavailable
from gaitswarm.services.optimizer.run.outage import Backoff

if TYPE_CHECKING:
    from gaitswarm.jobs.database.async_jobs import AsyncDatabaseJobs
    from gaitswarm.jobs.database.jobs import DatabaseJobs
    from gaitswarm.jobs.port import Jobs
    from gaitswarm.jobs.server.async_jobs import AsyncServerJobs
    from gaitswarm.jobs.server.jobs import ServerJobs
    from gaitswarm.settings import Settings


def open(  # noqa: A001 - `gaitswarm.open`, as `gzip.open`
    db: str | os.PathLike[str] | None = None, *, create: bool = True
) -> DatabaseJobs:
    """Open a database of jobs in this process.

    Args:
        db: A file name, sqlite:///FILE, or postgresql://USER:PASSWORD@HOST/DATABASE. None: that of
            the environment (GAITSWARM_DB), else the user's own, which `gaitswarm` uses as well.
        create: Whether an SQLite file that is not there is made.

    Returns:
        The jobs in it, as a context manager; `run` runs them here.

    Raises:
        NotFound: There is no such file, and none is to be made.
        StoreUnavailable: The database cannot be opened, or is of a later version.
    """
    from gaitswarm.jobs.database.jobs import DatabaseJobs
    from gaitswarm.services.optimizer.service import JobService
    from gaitswarm.services.runtime import open_store
    from gaitswarm.settings import read_settings

    settings = read_settings(db=None if db is None else os.fspath(db))
    url = database_to_write(settings) if create else database_to_read(settings)
    return DatabaseJobs(JobService(open_store(url)), url)


def open_async(
    db: str | os.PathLike[str] | None = None, *, create: bool = True
) -> AsyncDatabaseJobs:
    """Open a database of jobs, for a program with an event loop.

    Args:
        db: As for `open`.
        create: Whether an SQLite file that is not there is made.

    Returns:
        The jobs in it, as an asynchronous context manager, which opens the database and raises
        what `open` raises.
    """
    from gaitswarm.jobs.database.async_jobs import AsyncDatabaseJobs
    from gaitswarm.settings import read_settings

    url = read_settings(db=None if db is None else os.fspath(db)).database
    return AsyncDatabaseJobs(url, lambda: open(db, create=create))


def connect(
    url: str,
    *,
    timeout: float | None = None,
    backoff: Backoff | None = None,
    headers: Mapping[str, str] | None = None,
    token: str | None = None,
) -> ServerJobs:
    """Reach the jobs of a server, such as `gaitswarm serve`.

    Args:
        url: Of the server, such as http://127.0.0.1:8000. Nothing is sent yet.
        timeout: Longest silence of the server [s]; default 30.
        backoff: How long to wait before which of the further attempts, where a connection breaks
            or the server is busy, and the request may safely be repeated.
        headers: Sent with every request, such as what a proxy asks for.
        token: Of the server, where it asks for one. Default: that of the environment
            (GAITSWARM_TOKEN), unless the environment names another server (GAITSWARM_SERVER).

    Returns:
        The server's jobs, as a context manager.

    Raises:
        InvalidRequest: It is not a URL, or the token would go beyond this machine as plain text.
    """
    from gaitswarm.jobs.server.attempts import BACKOFF
    from gaitswarm.jobs.server.credentials import with_token
    from gaitswarm.jobs.server.jobs import TIMEOUT, ServerJobs
    from gaitswarm.settings import read_settings

    sent = with_token(url, headers, token, read_settings())
    return ServerJobs(url, timeout=timeout or TIMEOUT, backoff=backoff or BACKOFF, headers=sent)


def connect_async(
    url: str,
    *,
    timeout: float | None = None,
    backoff: Backoff | None = None,
    headers: Mapping[str, str] | None = None,
    token: str | None = None,
) -> AsyncServerJobs:
    """Reach the jobs of a server, for a program with an event loop.

    Args:
        url: Of the server, such as http://127.0.0.1:8000. Nothing is sent yet.
        timeout: Longest silence of the server [s]; default 30.
        backoff: As for `connect`.
        headers: Sent with every request.
        token: Of the server, where it asks for one. Default: that of the environment
            (GAITSWARM_TOKEN), unless the environment names another server (GAITSWARM_SERVER).

    Returns:
        The server's jobs, as an asynchronous context manager.

    Raises:
        InvalidRequest: It is not a URL, or the token would go beyond this machine as plain text.
    """
    from gaitswarm.jobs.server.async_jobs import AsyncServerJobs
    from gaitswarm.jobs.server.attempts import BACKOFF
    from gaitswarm.jobs.server.credentials import with_token
    from gaitswarm.jobs.server.jobs import TIMEOUT
    from gaitswarm.settings import read_settings

    sent = with_token(url, headers, token, read_settings())
    return AsyncServerJobs(
        url, timeout=timeout or TIMEOUT, backoff=backoff or BACKOFF, headers=sent
    )


def database_to_write(settings: Settings) -> str:
    """The database of the settings, ready for a process that may have to make it.

    Args:
        settings: Of this process.

    Returns:
        Its URL. The directory of the user's own database is made, and only that.

    Raises:
        StoreUnavailable: That directory cannot be made.
    """
    if settings.db is None:
        folder = Path(settings.database).parent
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise StoreUnavailable(
                f"cannot make {folder} for the database: {error.strerror}; name another place with"
                " --db or GAITSWARM_DB, or another data directory with XDG_DATA_HOME"
            ) from error
    return settings.database


def database_to_read(settings: Settings) -> str:
    """The database of the settings, for a process that makes none.

    Args:
        settings: Of this process.

    Returns:
        Its URL.

    Raises:
        NotFound: It is an SQLite file, and there is none.
    """
    file = _sqlite_file(settings.database)
    if file is not None and not file.exists():
        raise NotFound(
            f"there is no database {file} yet; `gaitswarm optimize` makes it with its first job,"
            " and --db or --server names another place"
        )
    return settings.database


def open_jobs(server: str | None, db: str | None, *, create: bool = False) -> Jobs:
    """Open the jobs that a command is about. An option goes before the environment, a server
    before a database.

    Args:
        server: URL of a server, as an option named it.
        db: A database, as an option named it.
        create: Whether an SQLite file that is not there is made.

    Returns:
        The jobs there, to be closed by the caller.

    Raises:
        InvalidRequest: Both are named, or a setting makes no sense.
        NotFound: There is no such file, and `create` is false.
        StoreUnavailable: The database cannot be opened.
    """
    from gaitswarm.settings import read_settings

    if server and db:
        raise InvalidRequest("jobs are either on a server or in a database", field="--server, --db")
    settings = read_settings(server=server or None, db=db or None)
    if settings.server and not db:
        # Somebody waits in front of a terminal.
        return connect(settings.server, backoff=Backoff(first=0.25, longest=5.0, attempts=2))
    return open(db or None, create=create)


def _sqlite_file(url: str) -> Path | None:
    scheme, separator, rest = url.partition("://")
    if not separator:
        return Path(url).expanduser()
    if scheme.split("+")[0] != "sqlite":
        return None
    return Path(rest.removeprefix("/").partition("?")[0]).expanduser()
