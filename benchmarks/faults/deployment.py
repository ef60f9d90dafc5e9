"""A deployment of gaitswarm on this machine: API, runners, database and perhaps a Ray cluster."""

from __future__ import annotations

import os
import secrets
import shutil
import socket
import subprocess
import sys
import tempfile
import time
from contextlib import ExitStack, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final, Literal, Self

from benchmarks.faults.machine import Calls, Disk, Network, Receiver, can, process_group
from benchmarks.faults.supervisor import Service
from gaitswarm.services.optimizer.errors import StoreUnavailable
from gaitswarm.services.optimizer.store import Store, open_store
from tests.store.postgres_server import postgres_binaries

ROOT: Final = Path(__file__).parents[2]
_COMMAND: Final = (sys.executable, "-u", "-c", "from gaitswarm.cli.main import main; main()")
_MEBIBYTES: Final = {"sqlite": 400, "postgresql": 400}
_RUNNERS: Final = 2

DatabaseKind = Literal["sqlite", "postgresql"]


@dataclass
class Deployment:
    """What runs, and what of the machine it has for itself. Use it as a context manager.

    Attributes:
        database: Kind of the database.
        with_ray: Whether walks run on a Ray cluster; else in the runners.
        with_clock: Whether its processes, but for Ray's own, have calls that can be changed.
        lease_seconds: Of the runners [s].
        folder: Of everything that it writes.
        url: Of the database as the campaign itself reaches it.
        api_url: Of the server.
        api: The server's process.
        runners: The runners' processes.
        cluster: The head of the Ray cluster.
        server: The PostgreSQL server.
        disk: That of the database; None where none can be had.
        network: Between PostgreSQL and the others; None where none can be had.
        calls: Theirs; None where they cannot be changed.
        receiver: Of the notifications about its jobs.
    """

    database: DatabaseKind = "sqlite"
    with_ray: bool = False
    with_clock: bool = True
    lease_seconds: float = 3.0
    folder: Path = field(init=False)
    url: str = field(init=False)
    api_url: str = field(init=False)
    api: Service = field(init=False)
    runners: list[Service] = field(init=False, default_factory=list)
    cluster: Service | None = field(init=False, default=None)
    server: Service | None = field(init=False, default=None)
    disk: Disk | None = field(init=False, default=None)
    network: Network | None = field(init=False, default=None)
    calls: Calls | None = field(init=False, default=None)
    receiver: Receiver = field(init=False, default_factory=Receiver)
    _ray_token: str = field(init=False, default_factory=lambda: secrets.token_hex(32))
    _stack: ExitStack = field(init=False, default_factory=ExitStack)

    def __enter__(self) -> Self:
        try:
            self._open()
        except BaseException:
            self._stack.close()
            raise
        return self

    def __exit__(self, *_: object) -> None:
        self._stack.close()

    @property
    def services(self) -> list[Service]:
        """All of them."""
        others = [service for service in (self.cluster, self.server) if service is not None]
        return [*others, self.api, *self.runners]

    def store(self) -> Store:
        """The database, as soon as it answers; the caller closes it."""
        while True:
            try:
                return open_store(self.url)
            except StoreUnavailable:
                time.sleep(0.2)

    def _open(self) -> None:
        self.folder = Path(tempfile.mkdtemp(prefix="faults-"))
        self.folder.chmod(0o755)
        self._stack.callback(shutil.rmtree, self.folder, ignore_errors=True)
        (self.folder / "logs").mkdir()
        data = self.folder / "data"
        data.mkdir()
        possible = can()
        if possible["disk"]:
            self.disk = Disk(data, _MEBIBYTES[self.database])
            self._stack.callback(self.disk.close)
        if self.with_clock and possible["clock"]:
            self.calls = Calls(self.folder, data)
        self._stack.enter_context(self.receiver)
        urls = self._open_database(data, possible["network"])
        self.url = urls[-1]
        self.store().close()
        ray = self._open_cluster() if self.with_ray else None
        port = free_port()
        self.api_url = f"http://127.0.0.1:{port}"
        self.api = self._service(
            "api", [*_COMMAND, "serve", "--no-runner", "--port", str(port)], {"DB": urls[0]}
        )
        for index in range(_RUNNERS):
            settings = {"DB": urls[1 + index], "EVALUATOR": "ray" if ray else "in-process"}
            if ray:
                settings["RAY_ADDRESS"] = ray
            name = f"runner-{index}"
            self.runners.append(self._service(name, [*_COMMAND, "runner"], settings, group=True))

    def _open_database(self, data: Path, can_cut: bool) -> list[str]:
        """Start it. URLs for the API, for each runner and for the campaign."""
        users = _RUNNERS + 2
        if self.database == "sqlite":
            return [str(data / "jobs.db")] * users
        binaries = postgres_binaries()
        assert binaries is not None, "PostgreSQL is not installed"
        drop = []
        if os.geteuid() == 0:
            shutil.chown(data, "postgres", "postgres")
            setpriv = str(shutil.which("setpriv"))
            drop = [setpriv, "--reuid", "postgres", "--regid", "postgres", "--clear-groups"]
        cluster = data / "postgres"
        initdb = [str(binaries / "initdb"), "-D", str(cluster), "-U", "gaitswarm", "-A", "trust"]
        quiet = subprocess.DEVNULL
        subprocess.run([*drop, *initdb, "-E", "UTF8", "-N"], check=True, stdout=quiet, cwd="/")
        with (cluster / "pg_hba.conf").open("a", encoding="ascii") as rules:
            rules.write("host all all 198.18.0.0/16 trust\n")
        within, hosts, listen = [], ["127.0.0.1"] * users, "127.0.0.1"
        if can_cut:
            self.network = Network(users)
            self._stack.callback(self.network.close)
            within = [str(shutil.which("ip")), "netns", "exec", self.network.name]
            hosts, listen = self.network.addresses, "*"
        port = free_port()
        options = {
            "listen_addresses": listen,
            "port": port,
            "unix_socket_directories": data,
            "max_wal_size": "64MB",
            "shared_buffers": "16MB",
        }
        settings = [part for name, value in options.items() for part in ("-c", f"{name}={value}")]
        command = [*within, *drop, str(binaries / "postgres"), "-D", str(cluster), *settings]
        self.server = self._service("postgresql", command, {})
        return [f"postgresql://gaitswarm@{host}:{port}/postgres" for host in hosts]

    def _open_cluster(self) -> str:
        port = free_port()
        files = Path(tempfile.mkdtemp(prefix="fr-", dir="/tmp"))
        self._stack.callback(shutil.rmtree, files, ignore_errors=True)
        command = [sys.executable, "-m", "gaitswarm.services.worker.ray_node", "--head"]
        command += ["--port", str(port), "--num-cpus", "2", "--num-gpus", "0"]
        command += ["--include-dashboard", "false", "--include-log-monitor", "false"]
        command += ["--object-store-memory", str(80 << 20), "--temp-dir", str(files)]
        command += ["--disable-usage-stats"]
        command += ["--node-ip-address", "127.0.0.1"]
        self.cluster = self._service("cluster", command, {}, with_clock=False)
        while True:
            with suppress(OSError), socket.create_connection(("127.0.0.1", port), timeout=1.0):
                return f"127.0.0.1:{port}"
            time.sleep(0.2)

    def _service(
        self,
        name: str,
        command: list[str],
        settings: dict[str, str],
        *,
        group: bool = False,
        with_clock: bool = True,
    ) -> Service:
        settings = {
            "LEASE_SECONDS": str(self.lease_seconds),
            # Every walk is to be walked.
            "CACHE": "false",
            "CPUS": "1",
            "CONCURRENT_JOBS": "2",
            "LOG_FORMAT": "json",
            "WEBHOOK_HOSTS": self.receiver.host,
            **settings,
        }
        outside = {k: v for k, v in os.environ.items() if not k.startswith(("GAITSWARM_", "RAY_"))}
        environment = outside | {f"GAITSWARM_{key}": value for key, value in settings.items()}
        environment["PYTHONPATH"] = str(ROOT)
        if self.with_ray:
            environment |= {"RAY_AUTH_MODE": "token", "RAY_AUTH_TOKEN": self._ray_token}
        if self.calls is not None and with_clock:
            environment |= self.calls.variables
        limits = None
        if group and can()["processes"]:
            limits = process_group(name)
            self._stack.callback(_remove, limits)
        service = Service(name, command, environment, self.folder / "logs", limits)
        self._stack.callback(service.close)
        return service


def free_port() -> int:
    """A free TCP port."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


def _remove(group: Path) -> None:
    with suppress(OSError):
        group.rmdir()
