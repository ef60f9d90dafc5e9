"""A private PostgreSQL server, for as long as the tests run."""

from __future__ import annotations

import os
import pwd
import shutil
import socket
import subprocess
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tests.examples import requirements


def postgres_binaries() -> Path | None:
    """Folder of initdb and pg_ctl, the newest there is; None where PostgreSQL is not installed."""
    on_path = shutil.which("initdb")
    installed = sorted(
        Path("/usr/lib/postgresql").glob("*/bin/initdb"), key=lambda p: float(p.parts[-3])
    )
    if installed:
        return installed[-1].parent
    return Path(on_path).parent if on_path else None


def server_binaries() -> Path:
    """Folder of initdb and pg_ctl; skips the test where there is none, or fails it."""
    binaries = postgres_binaries()
    requirements.POSTGRES.check(
        "" if binaries else "PostgreSQL is not installed (Debian: apt install postgresql)"
    )
    assert binaries is not None
    return binaries


@dataclass(frozen=True)
class PostgresServer:
    """A server of the tests' own.

    url: without the database, `postgresql://...:port`. durable: whether what was committed survives
    a power cut, which takes time.
    """

    binaries: Path
    folder: Path
    port: int
    user: pwd.struct_passwd | None
    durable: bool = False

    @property
    def url(self) -> str:
        return f"postgresql://gaitswarm@127.0.0.1:{self.port}"

    @property
    def runs(self) -> bool:
        return (self.folder / "data" / "postmaster.pid").exists()

    def start(self) -> None:
        """Start it, and wait until it answers."""
        fsync = "on" if self.durable else "off"
        options = f"-c listen_addresses=127.0.0.1 -c port={self.port} -k {self.folder}"
        log = self.folder / "log"
        self._control("start", "-l", log, "-o", f"{options} -c fsync={fsync}")

    def stop(self) -> None:
        """Let it die as in a crash: no goodbye to clients, and recovery at the next start."""
        self._control("stop", "-m", "immediate")

    def _control(self, action: str, *options: Path | str) -> None:
        data = self.folder / "data"
        _run([self.binaries / "pg_ctl", action, "-w", "-D", data, *options], self.user)


@contextmanager
def postgres_server(binaries: Path, *, durable: bool = False) -> Iterator[PostgresServer]:
    """A running server; it is gone at the end. durable: as of `PostgresServer`."""
    folder = Path(tempfile.mkdtemp(prefix="gaitswarm-pg-"))
    user = _unprivileged_user()
    try:
        if user is not None:
            os.chown(folder, user.pw_uid, user.pw_gid)
        trust = ["-U", "gaitswarm", "-A", "trust", "-E", "UTF8", "-N"]
        _run([binaries / "initdb", "-D", folder / "data", *trust], user)
        server = PostgresServer(binaries, folder, _free_port(), user, durable)
        server.start()
        try:
            yield server
        finally:
            server.stop()
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def _run(command: Sequence[Path | str], user: pwd.struct_passwd | None) -> None:
    identity: dict[str, Any] = (
        {} if user is None else {"user": user.pw_uid, "group": user.pw_gid, "extra_groups": []}
    )
    subprocess.run(
        command,
        check=True,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        cwd="/",
        timeout=60,
        **identity,
    )


def _unprivileged_user() -> pwd.struct_passwd | None:
    """PostgreSQL refuses to run as root."""
    if os.geteuid() != 0:
        return None
    names = {entry.pw_name for entry in pwd.getpwall()}
    return pwd.getpwnam("postgres" if "postgres" in names else "nobody")  # codespell:ignore nobody


def _free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])
