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
from pathlib import Path
from typing import Any


def postgres_binaries() -> Path | None:
    """Folder of initdb and pg_ctl, the newest there is; None where PostgreSQL is not installed."""
    on_path = shutil.which("initdb")
    installed = sorted(
        Path("/usr/lib/postgresql").glob("*/bin/initdb"), key=lambda p: float(p.parts[-3])
    )
    if installed:
        return installed[-1].parent
    return Path(on_path).parent if on_path else None


@contextmanager
def postgres_server(binaries: Path) -> Iterator[str]:
    """URL prefix of a running server, without the database: `postgresql://...:port`."""
    folder = Path(tempfile.mkdtemp(prefix="gaitswarm-pg-"))
    user = _unprivileged_user()
    try:
        if user is not None:
            os.chown(folder, user.pw_uid, user.pw_gid)
        data, port = folder / "data", _free_port()
        _run(
            [binaries / "initdb", "-D", data, "-U", "gaitswarm", "-A", "trust", "-E", "UTF8", "-N"],
            user,
        )
        options = f"-c listen_addresses=127.0.0.1 -c port={port} -k {folder} -c fsync=off"
        start: list[Path | str] = [
            binaries / "pg_ctl",
            "start",
            "-w",
            "-D",
            data,
            "-l",
            folder / "log",
        ]
        _run([*start, "-o", options], user)
        try:
            yield f"postgresql://gaitswarm@127.0.0.1:{port}"
        finally:
            _run([binaries / "pg_ctl", "stop", "-w", "-m", "immediate", "-D", data], user)
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
    return pwd.getpwnam("postgres" if "postgres" in names else "nobody")


def _free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])
