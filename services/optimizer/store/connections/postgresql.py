"""Connections to PostgreSQL that end by themselves, whoever has gone."""

from __future__ import annotations

import os
import selectors
import socket
from typing import Any, Final

from sqlalchemy import URL, Engine, create_engine, event
from sqlalchemy.exc import InvalidatePoolError

from gaitswarm.services.optimizer.errors import StoreUnavailable

SILENCE_SECONDS: Final = 15
"""After so long without a sign of life from the other end of a connection it has gone [s]."""

IDLE_SECONDS: Final = 20
"""How long a transaction may wait for its next statement [s]; a stopped client holds no lock."""

STATEMENT_SECONDS: Final = 120
"""How long a statement may take [s]; none of ours takes as long on histories of any length."""

_PROBES: Final = 2


def postgresql_engine(
    url: URL, options: dict[str, Any], *, lock_seconds: float, maintenance: bool = False
) -> Engine:
    """An engine on psycopg; it connects only when it is first used.

    Both ends probe a connection on which nothing comes, so that after a network partition the
    client knows within `SILENCE_SECONDS` that it has lost the server, and the server ends the
    transaction of a client that is out of reach, with its locks.

    Args:
        url: As `parse_url` has it. Its query goes before what is set here.
        options: Of `create_engine`.
        lock_seconds: How long a statement waits for another transaction's lock [s].
        maintenance: Whether statements, and pauses between them, may take as long as they do.

    Returns:
        The engine.

    Raises:
        StoreUnavailable: The driver is not installed.
    """
    connect_args: dict[str, Any] = {
        # libpq adds its version of it to what the server lists; longer names are cut there.
        "application_name": f"gaitswarm {socket.gethostname()[:40]}:{os.getpid()}",
        "connect_timeout": SILENCE_SECONDS,
        "keepalives_idle": SILENCE_SECONDS // (_PROBES + 1),
        "keepalives_interval": SILENCE_SECONDS // (_PROBES + 1),
        "keepalives_count": _PROBES,
        "tcp_user_timeout": SILENCE_SECONDS * 1000,
    }
    connect_args = {name: value for name, value in connect_args.items() if name not in url.query}
    settings = _session(lock_seconds, maintenance=maintenance)
    # The last of several equal settings counts.
    own = url.query.get("options", "")
    given = own if isinstance(own, str) else " ".join(own)
    connect_args["options"] = " ".join([*(f"-c {k}={v}" for k, v in settings.items()), given])
    try:
        engine = create_engine(url, connect_args=connect_args, **options)
    except ModuleNotFoundError as error:
        raise StoreUnavailable(
            f"PostgreSQL needs {error.name}: install gaitswarm[postgres]"
        ) from error
    _replace_cut_connections(engine)
    return engine


def _replace_cut_connections(engine: Engine) -> None:
    """A connection that a restart of the server has cut is replaced before it is used.

    The end of a connection comes to its socket, as do notices. So the server is asked whether it is
    there only where something has come to a connection that was idle, and not each time.
    """

    @event.listens_for(engine, "checkout")
    def _look(connection: Any, _record: object, _proxy: object) -> None:
        try:
            with selectors.DefaultSelector() as selector:
                selector.register(connection, selectors.EVENT_READ)
                if selector.select(0):
                    engine.dialect.do_ping(connection)
        except engine.dialect.loaded_dbapi.Error as error:
            raise InvalidatePoolError from error


def _session(lock_seconds: float, *, maintenance: bool) -> dict[str, int]:
    """Settings of a session [s, ms or a count, as PostgreSQL has them]."""
    settings = {
        "lock_timeout": round(lock_seconds * 1000),
        "tcp_keepalives_idle": SILENCE_SECONDS // (_PROBES + 1),
        "tcp_keepalives_interval": SILENCE_SECONDS // (_PROBES + 1),
        "tcp_keepalives_count": _PROBES,
        "tcp_user_timeout": SILENCE_SECONDS * 1000,
    }
    if not maintenance:
        settings |= {
            "statement_timeout": STATEMENT_SECONDS * 1000,
            "idle_in_transaction_session_timeout": IDLE_SECONDS * 1000,
        }
    return settings
