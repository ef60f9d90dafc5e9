"""Which jobs a command means, and the way to them."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from services.optimizer.errors import InvalidRequest, NotFound, StoreUnavailable

if TYPE_CHECKING:
    from gaitswarm.jobs.port import Jobs
    from gaitswarm.settings import Settings


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
        from gaitswarm.jobs.remote import RemoteJobs

        return RemoteJobs(settings.server)

    from gaitswarm.jobs.local import LocalJobs
    from services.optimizer.service import JobService
    from services.runtime import open_store

    url = database_to_write(settings) if create else settings.database
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
