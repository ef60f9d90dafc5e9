"""PostgreSQL goes away in mid-run, or a client of it does: nothing hangs, nothing is lost."""

from __future__ import annotations

import json
import os
import shutil
import socket
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import closing

import pytest
from sqlalchemy import text

from gaitswarm.services.optimizer.errors import StoreUnavailable
from gaitswarm.services.optimizer.jobs.job import Job, JobState
from gaitswarm.services.optimizer.run.runner import Runner
from gaitswarm.services.optimizer.store import Store, engine, open_store
from gaitswarm.services.optimizer.store.engine import Database
from tests.examples import requirements
from tests.examples.jobs import Bits, history
from tests.examples.paths import ROOT
from tests.examples.processes import eventually
from tests.optimizer.formula import SPEC, FormulaEvaluator
from tests.store.examples import LEASE, spec
from tests.store.partition_process import SILENCE_SECONDS
from tests.store.postgres_server import PostgresServer, server_binaries

pytestmark = pytest.mark.slow

UNSHARE = shutil.which("unshare")

LONG = SPEC.model_copy(update={"iterations": 40})
"""Half a second of commits, at least."""


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory: pytest.TempPathFactory) -> list[Bits]:
    """The history of the long job where nothing goes wrong."""
    path = tmp_path_factory.mktemp("undisturbed") / "jobs.db"
    with closing(open_store(str(path))) as store:
        return history(store, run_to_its_end(store, 30.0, threading.Event()).id)


@pytest.fixture
def database(postgresql_server: PostgresServer) -> Iterator[Database]:
    """Connections as the store has them, to a server that lasts."""
    database = Database(f"{postgresql_server.url}/postgres")
    yield database
    database.close()


def run_to_its_end(store: Store, lease_seconds: float, disturb: threading.Event) -> Job:
    """Run a long job; `disturb` is set in its midst."""
    job, _ = store.create_job(LONG)
    runner = Runner(store, FormulaEvaluator(), lease_seconds=lease_seconds, poll_seconds=0.05)
    runner.start()
    try:
        eventually(lambda: store.job(job.id).progress.iterations > 5)
        disturb.set()

        def ended() -> bool:
            try:
                return store.job(job.id).state.terminal
            except StoreUnavailable:
                return False

        eventually(ended)
    finally:
        runner.stop()
    return store.job(job.id)


@pytest.mark.variants
@pytest.mark.parametrize("lease_seconds", [30.0, 0.5], ids=["within-a-lease", "past-a-lease"])
def test_a_crash_of_the_server_in_mid_run_changes_no_bit_of_a_history(
    stoppable_server: PostgresServer, undisturbed: list[Bits], lease_seconds: float
) -> None:
    crash = threading.Event()

    def restart() -> None:
        crash.wait()
        stoppable_server.stop()
        if lease_seconds < 1.0:
            threading.Event().wait(2.0 * lease_seconds)
        stoppable_server.start()

    thread = threading.Thread(target=restart)
    thread.start()
    with closing(open_store(f"{stoppable_server.url}/postgres")) as store:
        job = run_to_its_end(store, lease_seconds, crash)
        thread.join()
        assert job.state is JobState.SUCCEEDED, job.error
        assert history(store, job.id) == undisturbed


@pytest.mark.parametrize(
    ("required", "outcome"), [(True, pytest.fail.Exception), (False, pytest.skip.Exception)]
)
def test_a_missing_server_fails_these_tests_where_they_must_run(
    required: bool, outcome: type[BaseException], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(requirements.POSTGRES, "must_run", required)
    monkeypatch.setattr("tests.store.postgres_server.postgres_binaries", lambda: None)
    with pytest.raises(outcome, match="PostgreSQL is not installed"):
        server_binaries()


def test_a_connection_that_was_cut_is_replaced_before_it_is_used(
    database: Database, postgresql_server: PostgresServer
) -> None:
    def backend() -> int:
        with database.read() as connection:
            return int(connection.execute(text("SELECT pg_backend_pid()")).scalar_one())

    first = backend()
    assert backend() == first
    other = Database(f"{postgresql_server.url}/postgres")
    with other.write() as connection:
        connection.execute(text("SELECT pg_terminate_backend(:pid, 5000)"), {"pid": first})
    other.close()
    assert backend() != first


def test_what_is_only_read_holds_no_transaction(database: Database) -> None:
    with database.read() as connection:
        started = text("SELECT now()")
        first = connection.execute(started).scalar_one()
        assert connection.execute(started).scalar_one() > first
    with database.write() as connection:
        first = connection.execute(started).scalar_one()
        assert connection.execute(started).scalar_one() == first


def test_both_ends_notice_within_a_lease_that_the_other_has_gone(database: Database) -> None:
    with database.read() as connection:

        def setting(name: str) -> int:
            milliseconds = text("SELECT setting FROM pg_settings WHERE name = :name")
            return int(connection.execute(milliseconds, {"name": name}).scalar_one())

        probes = setting("tcp_keepalives_count") * setting("tcp_keepalives_interval")
        assert setting("tcp_keepalives_idle") + probes == engine.SILENCE_SECONDS
        assert setting("tcp_user_timeout") == engine.SILENCE_SECONDS * 1000
        assert setting("idle_in_transaction_session_timeout") == engine.IDLE_SECONDS * 1000
        assert setting("statement_timeout") == engine.STATEMENT_SECONDS * 1000

        driver = connection.connection.driver_connection
        assert driver is not None
        with closing(socket.socket(fileno=socket.dup(driver.fileno()))) as ours:
            idle = ours.getsockopt(socket.IPPROTO_TCP, socket.TCP_KEEPIDLE)
            interval = ours.getsockopt(socket.IPPROTO_TCP, socket.TCP_KEEPINTVL)
            count = ours.getsockopt(socket.IPPROTO_TCP, socket.TCP_KEEPCNT)
            assert idle + interval * count == engine.SILENCE_SECONDS
            unanswered = ours.getsockopt(socket.IPPROTO_TCP, socket.TCP_USER_TIMEOUT)
            assert unanswered == engine.SILENCE_SECONDS * 1000


@pytest.mark.thorough("test_both_ends_notice_within_a_lease_that_the_other_has_gone")
@pytest.mark.skipif(
    os.geteuid() != 0 or UNSHARE is None or shutil.which("ip") is None,
    reason="a network of its own takes root, unshare and ip",
)
def test_a_runner_that_the_network_cuts_off_lets_go_of_its_job() -> None:
    server_binaries()
    done = subprocess.run(
        [str(UNSHARE), "-n", sys.executable, "-m", "tests.store.partition_process"],
        capture_output=True,
        check=False,
        text=True,
        timeout=120,
        cwd=ROOT,
    )
    assert done.returncode == 0, done.stderr
    seconds = json.loads(done.stdout)
    # The runner knows that it lost the server, and another one holds the job, which was locked.
    assert max(seconds.values()) < 2.0 * SILENCE_SECONDS


def test_the_url_goes_before_what_is_set_by_default(postgresql_server: PostgresServer) -> None:
    options = "options=-c%20statement_timeout%3D7000&application_name=mine"
    database = Database(f"{postgresql_server.url}/postgres?{options}")
    with database.read() as connection:
        shown = [
            connection.execute(text(f"SHOW {name}")).scalar_one()
            for name in ("statement_timeout", "application_name", "tcp_keepalives_count")
        ]
    database.close()
    assert shown == ["7s", "mine", "2"]


@pytest.mark.parametrize("database_url", ["postgresql"], indirect=True)
def test_a_client_that_stops_within_a_transaction_loses_its_locks(
    database_url: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    with closing(open_store(database_url)) as store:
        job, _ = store.create_job(spec())
        monkeypatch.setattr(engine, "IDLE_SECONDS", 1)
        stopped = Database(database_url)

        def lock_and_stop() -> None:
            with stopped.write() as connection:
                connection.execute(text("SELECT id FROM jobs FOR UPDATE"))
                assert store.claim("passes over it", lease_seconds=LEASE) is None
                assert store.claim("waits", lease_seconds=LEASE, job_id=job.id) is not None
                connection.execute(text("SELECT 1"))

        with pytest.raises(StoreUnavailable, match="idle-in-transaction"):
            lock_and_stop()
        stopped.close()


def test_a_statement_that_takes_too_long_counts_as_an_outage(
    postgresql_server: PostgresServer, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(engine, "STATEMENT_SECONDS", 1)
    database = Database(f"{postgresql_server.url}/postgres")
    with (
        pytest.raises(StoreUnavailable, match="statement timeout"),
        database.read() as connection,
    ):
        connection.execute(text("SELECT pg_sleep(60)"))
    database.close()
