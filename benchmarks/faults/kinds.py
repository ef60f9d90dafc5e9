"""The kinds of faults: how each is brought about, and how it ends."""

from __future__ import annotations

import os
import resource
import signal
import sqlite3
import time
from abc import ABC, abstractmethod
from contextlib import suppress
from pathlib import Path
from typing import ClassVar, Final

from sqlalchemy import Connection, Engine, NullPool, create_engine, text

from benchmarks.faults.deployment import Deployment
from benchmarks.faults.supervisor import Service

_MEBIBYTE: Final = 1 << 20


class Fault(ABC):
    """A fault in a deployment.

    Attributes:
        name: Of its kind.
        shortest, longest: How long it lasts [s].

    Args:
        deployment: What it is a fault of.
        draw: From [0, 1): chooses the victim.
    """

    name: ClassVar[str]
    shortest: float = 0.0
    longest: float = 0.0

    def __init__(self, deployment: Deployment, draw: float) -> None:
        self.deployment, self.draw = deployment, draw

    @staticmethod
    def possible(deployment: Deployment) -> bool:
        """Whether it can be brought about in a deployment."""
        del deployment
        return True

    @abstractmethod
    def inject(self) -> None:
        """Let it begin."""

    def heal(self) -> None:  # noqa: B027 - a process that was killed needs no healing
        """Let it end."""

    @property
    def runner(self) -> Service:
        """The runner that it hits."""
        runners = self.deployment.runners
        return runners[int(self.draw * len(runners))]


class KillApi(Fault):
    name = "kill-api"

    def inject(self) -> None:
        self.deployment.api.send(signal.SIGKILL)


class KillRunner(Fault):
    name = "kill-runner"

    def inject(self) -> None:
        self.runner.send(signal.SIGKILL)


class KillPostgres(Fault):
    """The postmaster, or one of its processes."""

    name = "kill-postgresql"

    @staticmethod
    def possible(deployment: Deployment) -> bool:
        return deployment.server is not None

    def inject(self) -> None:
        server = self.deployment.server
        assert server is not None
        victims = [server.pid, *server.below("postgres")]
        _kill(victims[0] if self.draw < 0.5 else victims[int(self.draw * len(victims))])


class _OfRay(Fault):
    titles: ClassVar[tuple[str, ...]]
    not_titles: ClassVar[tuple[str, ...]] = ()

    @staticmethod
    def possible(deployment: Deployment) -> bool:
        return deployment.cluster is not None

    def inject(self) -> None:
        assert self.deployment.cluster is not None
        cluster = self.deployment.cluster
        others = set(cluster.below(*self.not_titles))
        victims = [pid for pid in cluster.below(*self.titles) if pid not in others]
        if victims:
            _kill(victims[int(self.draw * len(victims))])


class KillWorker(_OfRay):
    name = "kill-worker"
    titles = ("ray::",)
    not_titles = ("Agent",)


class _OfTheHead(_OfRay):
    """It takes the head with it, and is over when that is started again."""

    _restarts = 0

    def inject(self) -> None:
        assert self.deployment.cluster is not None
        self._restarts = self.deployment.cluster.restarts
        super().inject()

    def heal(self) -> None:
        assert self.deployment.cluster is not None
        ends = time.monotonic() + 30.0
        while self.deployment.cluster.restarts == self._restarts and time.monotonic() < ends:
            time.sleep(0.1)


class KillRaylet(_OfTheHead):
    name = "kill-raylet"
    titles = ("/raylet/raylet",)


class KillGcs(_OfTheHead):
    name = "kill-gcs"
    titles = ("gcs_server",)


class KillAgent(_OfTheHead):
    """An agent of a raylet, which ends by itself then, and says that all is well."""

    name = "kill-agent"
    titles = ("Agent",)


class ClusterAway(_OfRay):
    name = "cluster-away"
    shortest = longest = 20.0

    def inject(self) -> None:
        assert self.deployment.cluster is not None
        self.deployment.cluster.take_away()

    def heal(self) -> None:
        assert self.deployment.cluster is not None
        self.deployment.cluster.bring_back()


class StopRunner(Fault):
    """SIGSTOP past a lease, then SIGCONT: it wakes when its jobs are another's."""

    name = "stop-runner"

    def __init__(self, deployment: Deployment, draw: float) -> None:
        super().__init__(deployment, draw)
        self.shortest = deployment.lease_seconds + 0.5
        self.longest = deployment.lease_seconds + 4.0
        self._victim = self.runner.pid

    def inject(self) -> None:
        _kill(self._victim, signal.SIGSTOP)

    def heal(self) -> None:
        _kill(self._victim, signal.SIGCONT)


class DatabaseLocked(Fault):
    """Another process's transaction holds the write lock."""

    name = "database-locked"
    shortest, longest = 1.0, 8.0
    _sqlite: sqlite3.Connection | None = None
    _postgresql: Connection | None = None
    _engine: Engine | None = None

    def inject(self) -> None:
        with suppress(Exception):
            if self.deployment.server is None:
                self._sqlite = sqlite3.connect(self.deployment.url, timeout=10.0)
                self._sqlite.execute("BEGIN IMMEDIATE")
            else:
                url = self.deployment.url.replace("postgresql://", "postgresql+psycopg://")
                self._engine = create_engine(url, poolclass=NullPool)
                self._postgresql = self._engine.connect()
                self._postgresql.execute(text("LOCK TABLE jobs IN ACCESS EXCLUSIVE MODE"))

    def heal(self) -> None:
        for held in (self._sqlite, self._postgresql):
            if held is not None:
                with suppress(Exception):
                    held.rollback()
                    held.close()


class DiskFull(Fault):
    name = "disk-full"
    shortest, longest = 1.0, 6.0

    @staticmethod
    def possible(deployment: Deployment) -> bool:
        return deployment.disk is not None

    def inject(self) -> None:
        assert self.deployment.disk is not None
        self.deployment.disk.fill()

    def heal(self) -> None:
        assert self.deployment.disk is not None
        self.deployment.disk.make_room()


class ClockStep(Fault):
    """The time of day jumps by an hour, forth or back, and then to what it was."""

    name = "clock-step"
    shortest, longest = 1.0, 5.0

    @staticmethod
    def possible(deployment: Deployment) -> bool:
        return deployment.calls is not None

    def inject(self) -> None:
        assert self.deployment.calls is not None
        self.deployment.calls.step_to(3600 if self.draw < 0.5 else -3600)

    def heal(self) -> None:
        assert self.deployment.calls is not None
        self.deployment.calls.step_to(0)


class ClockStepAndKill(ClockStep):
    """A runner is killed whose clock is a day ahead, with all leases that it wrote."""

    name = "clock-step-kill"
    shortest, longest = 3.0, 6.0

    def inject(self) -> None:
        assert self.deployment.calls is not None
        self.deployment.calls.step_to(86_400)
        time.sleep(self.deployment.lease_seconds / 2)
        self.runner.send(signal.SIGKILL)


class DiskError(Fault):
    """Every write to the database's disk fails; PostgreSQL ends, and recovers at its restart."""

    name = "disk-error"
    shortest, longest = 0.5, 4.0

    @staticmethod
    def possible(deployment: Deployment) -> bool:
        return deployment.calls is not None

    def inject(self) -> None:
        assert self.deployment.calls is not None
        self.deployment.calls.fail_writes(True)

    def heal(self) -> None:
        assert self.deployment.calls is not None
        self.deployment.calls.fail_writes(False)


class FileReplaced(Fault):
    """The SQLite file is moved away, half of the time with another in its place, and put back.

    It is open in all processes: one that starts meanwhile takes the other file for its database,
    and has to be started again.
    """

    name = "file-replaced"
    shortest, longest = 1.0, 4.0

    @staticmethod
    def possible(deployment: Deployment) -> bool:
        return deployment.server is None

    def inject(self) -> None:
        while not all(map(self._has_opened, [self.deployment.api, *self.deployment.runners])):
            time.sleep(0.05)
        for file in self._files():
            with suppress(FileNotFoundError):
                file.rename(self._away(file))
        if self.draw < 0.5:
            self._files()[0].touch()

    def heal(self) -> None:
        for file in self._files():
            file.unlink(missing_ok=True)
        for file in self._files():
            with suppress(FileNotFoundError):
                self._away(file).rename(file)

    def _has_opened(self, service: Service) -> bool:
        try:
            files = [str(file.readlink()) for file in Path(f"/proc/{service.pid}/fd").iterdir()]
        except OSError:
            return False
        return self.deployment.url in files

    def _files(self) -> list[Path]:
        return [Path(self.deployment.url + end) for end in ("", "-wal", "-shm")]

    @staticmethod
    def _away(file: Path) -> Path:
        return file.with_name(f"away-{file.name}")


class SlowReceiver(Fault):
    """The receiver of notifications answers, but never to the end."""

    name = "slow-receiver"
    shortest, longest = 2.0, 15.0

    def inject(self) -> None:
        self.deployment.receiver.slow = True

    def heal(self) -> None:
        self.deployment.receiver.slow = False


class ForkRefused(Fault):
    """No process and no thread is to be had any more."""

    name = "fork-refused"
    shortest, longest = 1.0, 6.0

    @staticmethod
    def possible(deployment: Deployment) -> bool:
        return all(runner.group is not None for runner in deployment.runners)

    def inject(self) -> None:
        self._limit("1")

    def heal(self) -> None:
        self._limit("max")

    def _limit(self, most: str) -> None:
        assert self.runner.group is not None
        (self.runner.group / "pids.max").write_text(most, encoding="ascii")


class OutOfMemory(Fault):
    """A runner gets no more address space than it has."""

    name = "out-of-memory"
    shortest, longest = 1.0, 5.0
    _before: tuple[int, int, int] | None = None

    def inject(self) -> None:
        pid = self.runner.pid
        with suppress(OSError):
            with open(f"/proc/{pid}/statm", encoding="ascii") as status:  # noqa: PTH123
                size = int(status.read().split()[0]) * resource.getpagesize()
            soft, hard = resource.prlimit(pid, resource.RLIMIT_AS)
            resource.prlimit(pid, resource.RLIMIT_AS, (size + _MEBIBYTE, hard))
            self._before = pid, soft, hard

    def heal(self) -> None:
        if self._before is not None:
            pid, soft, hard = self._before
            with suppress(OSError):
                resource.prlimit(pid, resource.RLIMIT_AS, (soft, hard))


class Partition(Fault):
    """The cable between PostgreSQL and the API or a runner is pulled."""

    name = "partition"
    shortest, longest = 2.0, 25.0

    @staticmethod
    def possible(deployment: Deployment) -> bool:
        return deployment.network is not None

    def inject(self) -> None:
        assert self.deployment.network is not None
        self.deployment.network.cut(self._client)

    def heal(self) -> None:
        assert self.deployment.network is not None
        self.deployment.network.mend(self._client)

    @property
    def _client(self) -> int:
        return int(self.draw * (1 + len(self.deployment.runners)))


def _kill(pid: int, number: signal.Signals = signal.SIGKILL) -> None:
    with suppress(ProcessLookupError):
        os.kill(pid, number)


KINDS: Final[dict[str, type[Fault]]] = {
    kind.name: kind
    for kind in (
        *(KillApi, KillRunner, KillPostgres, KillWorker, KillRaylet, KillGcs, KillAgent),
        *(StopRunner, DatabaseLocked, DiskFull, ClockStep, ForkRefused, OutOfMemory),
        *(Partition, ClusterAway, ClockStepAndKill, DiskError, FileReplaced, SlowReceiver),
    )
}
"""Every kind by its name."""
