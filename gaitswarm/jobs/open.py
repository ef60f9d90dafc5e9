"""Connections to jobs: a database, a server, or the one that options and environment name."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Final
from urllib.parse import SplitResult, urlsplit

from gaitswarm.services.optimizer.errors import InvalidRequest, NotFound, StoreUnavailable
from gaitswarm.services.optimizer.masking import masked_url
from gaitswarm.services.optimizer.run.outage import Backoff

if TYPE_CHECKING:
    from gaitswarm.jobs.base import Jobs
    from gaitswarm.jobs.database import DatabaseJobs
    from gaitswarm.jobs.server import ServerJobs
    from gaitswarm.settings import Settings

_PORTS: Final = {"http": 80, "https": 443}


def open(  # noqa: A001 - `gaitswarm.open`, as `gzip.open`
    db: str | os.PathLike[str] | None = None, *, create: bool = True
) -> DatabaseJobs:
    """Open a database of jobs in this process.

    Args:
        db: A file name, sqlite:///FILE, or postgresql://USER:PASSWORD@HOST/DATABASE. None: that of
            the environment (GAITSWARM_DB), else the user's own, which `gaitswarm` uses as well.
        create: Whether to create an SQLite file that does not exist.

    Returns:
        The jobs in it, as a context manager; `run` runs them in this process.

    Raises:
        NotFound: The file does not exist, and is not to be created.
        StoreUnavailable: The database cannot be opened, or is of a later version.
    """
    from gaitswarm.jobs.database import DatabaseJobs
    from gaitswarm.services.optimizer.service import JobService
    from gaitswarm.services.optimizer.store import open_store
    from gaitswarm.settings import read_settings

    settings = read_settings(db=None if db is None else os.fspath(db))
    url = database_to_write(settings) if create else database_to_read(settings)
    return DatabaseJobs(JobService(open_store(url)), url)


def connect(
    url: str,
    *,
    timeout: float | None = None,
    backoff: Backoff | None = None,
    headers: Mapping[str, str] | None = None,
    token: str | None = None,
) -> ServerJobs:
    """Connect to a server, such as `gaitswarm serve`.

    Args:
        url: Of the server, such as http://127.0.0.1:8000. Nothing is sent yet.
        timeout: Longest silence of the server [s]; default 30.
        backoff: Waits before a request is repeated, if the connection breaks or the server is busy
            and repeating it is safe.
        headers: Sent with every request, such as a proxy requires.
        token: Token of the server, if it requires one. Default: that of the environment
            (GAITSWARM_TOKEN), unless the environment names another server (GAITSWARM_SERVER).

    Returns:
        The server's jobs, as a context manager.

    Raises:
        InvalidRequest: It is not a URL, or the token would leave this machine as plain text.
    """
    from gaitswarm.jobs.server import BACKOFF, TIMEOUT, ServerJobs
    from gaitswarm.settings import read_settings

    sent = with_token(url, headers, token, read_settings())
    return ServerJobs(url, timeout=timeout or TIMEOUT, backoff=backoff or BACKOFF, headers=sent)


def with_token(
    url: str, headers: Mapping[str, str] | None, token: str | None, settings: Settings
) -> dict[str, str]:
    """Add a token to headers without Authorization: the environment's only for its own server."""
    from gaitswarm.jobs.server import server_url
    from gaitswarm.settings import is_loopback

    parts, sent = urlsplit(server_url(url)), dict(headers or {})
    if any(name.lower() == "authorization" for name in sent):
        return sent
    own = settings.server
    if token is None and (own is None or _origin(parts) == _origin(urlsplit(server_url(own)))):
        token = settings.token
    if not token:
        return sent
    guarded = parts.scheme == "https" or is_loopback(parts.hostname or "")
    if not guarded and not settings.token_over_http:
        raise InvalidRequest(
            f"a token would go to {masked_url(url)} as plain text, which anybody on the way can"
            " read; use an https:// URL (docs/security.md has a proxy for it) or a tunnel, or set"
            " GAITSWARM_TOKEN_OVER_HTTP=true where the network is trusted",
            field="server",
        )
    sent["Authorization"] = f"Bearer {token}"
    return sent


def _origin(url: SplitResult) -> tuple[str, str | None, int | None]:
    return url.scheme, url.hostname, url.port or _PORTS.get(url.scheme)


def database_to_write(settings: Settings) -> str:
    """Return the URL of the settings' database, and create the directory of the default one."""
    if settings.db is None:
        folder = Path(settings.database).parent
        try:
            folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        except OSError as error:
            raise StoreUnavailable(
                f"cannot make {folder} for the database: {error.strerror}; name another place with"
                " --db or GAITSWARM_DB, or another data directory with XDG_DATA_HOME"
            ) from error
    return settings.database


def database_to_read(settings: Settings) -> str:
    """Return the URL of the settings' database; raise NotFound for a missing SQLite file."""
    file = _sqlite_file(settings.database)
    if file is not None and not file.exists():
        raise NotFound(
            f"there is no database {file} yet; `gaitswarm optimize` makes it with its first job,"
            " and --db or --server names another place"
        )
    return settings.database


def open_jobs(server: str | None, db: str | None, *, create: bool = False) -> Jobs:
    """Open the jobs of a command. Options precede the environment, servers precede databases."""
    from gaitswarm.settings import read_settings

    if server and db:
        raise InvalidRequest("jobs are either on a server or in a database", field="--server, --db")
    settings = read_settings(server=server or None, db=db or None)
    if settings.server and not db:
        # A person is waiting.
        return connect(settings.server, backoff=Backoff(first=0.25, longest=5.0, attempts=2))
    return open(db or None, create=create)


def _sqlite_file(url: str) -> Path | None:
    scheme, separator, rest = url.partition("://")
    if not separator:
        return Path(url).expanduser()
    if scheme.split("+")[0] != "sqlite":
        return None
    return Path(rest.removeprefix("/").partition("?")[0]).expanduser()
