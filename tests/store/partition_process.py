"""The network cuts a runner off from PostgreSQL, in a namespace that this process is alone in.

Prints as JSON how long the runner and another one, which reaches the server, take to notice [s].
"""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
import time
from contextlib import closing
from threading import Thread

from sqlalchemy import text

from gaitswarm.services.optimizer.errors import LeaseLost, StoreUnavailable
from gaitswarm.services.optimizer.store import engine, open_store
from gaitswarm.services.optimizer.store.engine import Database
from tests.store.examples import ask, completed, spec
from tests.store.postgres_server import postgres_binaries, postgres_server

IP = str(shutil.which("ip"))

SILENCE_SECONDS = 3
LEASE_SECONDS = 1.0


def network(state: str) -> None:
    subprocess.run([IP, "link", "set", "lo", state], check=True)


def main() -> None:
    engine.SILENCE_SECONDS = SILENCE_SECONDS  # type: ignore[misc]
    network("up")
    binaries = postgres_binaries()
    assert binaries is not None
    with postgres_server(binaries) as server:
        by_network = f"{server.url}/postgres"
        # A socket of the file system knows no network.
        direct = f"postgresql://gaitswarm@/postgres?host={server.folder}&port={server.port}"
        with closing(open_store(by_network)) as cut_off, closing(open_store(direct)) as other:
            cut_off.create_job(spec())
            claim = cut_off.claim("cut off", lease_seconds=LEASE_SECONDS)
            assert claim is not None
            cut_off.begin(claim, ask(0))
            seconds: dict[str, float] = {}
            working = Thread(target=hold_the_job, args=(by_network, seconds))
            working.start()
            while other.claim("other", lease_seconds=60.0) is None:
                time.sleep(0.05)
            seconds["taken_over"] = time.monotonic()
            working.join()
            network("up")
            try:
                cut_off.commit(claim, completed(0), ask(1))
            except LeaseLost:
                began = seconds.pop("cut")
                passed = {name: at - began for name, at in seconds.items()}
                sys.stdout.write(json.dumps(passed) + "\n")


def hold_the_job(url: str, seconds: dict[str, float]) -> None:
    """Be cut off in the midst of a transaction that has the job locked."""
    database = Database(url)
    try:
        with database.write() as connection:
            connection.execute(text("SELECT id FROM jobs FOR UPDATE"))
            network("down")
            seconds["cut"] = time.monotonic()
            connection.execute(text("SELECT 1"))
    except StoreUnavailable:
        seconds["noticed"] = time.monotonic()
    database.close()


if __name__ == "__main__":
    main()
