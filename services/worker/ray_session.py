"""Sessions of Ray: a local cluster that ends with this process, or a connection to a cluster"""

from __future__ import annotations

import logging
import os
import secrets
import shutil
import socket
import tempfile
import warnings
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from types import ModuleType
from typing import Any, Final

from gaitswarm.services.optimizer.errors import EvaluatorUnavailable
from gaitswarm.services.worker.dispatch import available_cpus
from gaitswarm.services.worker.ray_node import OBJECT_STORE_BYTES, JoinedNode, comes_here

_log = logging.getLogger(__name__)

_ANSWER_SECONDS: Final = 2.0
"""Time in which a head lists its nodes."""

_ALIVE: Final = 0
"""State of a node in Ray's tables."""

_PREFIX: Final = "gaitswarm-ray-"

_BEFORE_IMPORT: Final = {
    "RAY_USAGE_STATS_ENABLED": "0",
    # Under `uv run`, Ray would package the checkout and install it again.
    "RAY_ENABLE_UV_RUN_RUNTIME_ENV": "0",
    # Its handler would take SIGTERM from this process, for good when a connection is closed.
    "RAY_DISABLE_FAILURE_SIGNAL_HANDLER": "1",
    # The default of later versions; init warns without it.
    "RAY_ACCEL_ENV_VAR_OVERRIDE_ON_ZERO": "0",
    # Errors of abandoned tasks are of no interest.
    "RAY_IGNORE_UNHANDLED_ERRORS": "1",
    # As other deaths; by default, tasks that take too much memory are repeated for ever.
    "RAY_task_oom_retries": "2",
    # A call after the connection has ended must not start another cluster.
    "RAY_ENABLE_AUTO_CONNECT": "0",
}

_UNUSED: Final = ("start_api_server", "start_monitor", "start_log_monitor")
"""Methods that start processes of a head which a local cluster does not need."""

WORKER_ENVIRONMENT: Final = {
    # The slots are the parallelism.
    "OMP_NUM_THREADS": "1",
    "OPENBLAS_NUM_THREADS": "1",
    "MKL_NUM_THREADS": "1",
    # There is no metrics agent.
    "RAY_enable_metrics_collection": "0",
}


@dataclass(slots=True)
class RaySession:
    """A connection to Ray; `directory` and `node` are what it has started itself."""

    ray: ModuleType
    head: tuple[str, int]
    directory: Path | None = None
    node: JoinedNode | None = None

    def head_answers(self) -> bool:
        """Return whether the control service accepts connections."""
        return listens(*self.head)

    def raylet_runs(self) -> bool:
        """Return whether this process's own raylet runs; without it Ray ends the process."""
        started = self.ray._private.worker._global_node  # noqa: SLF001 - there is no other way
        return started is None or all(kind != "raylet" for kind, _ in started.dead_processes())

    def nodes(self) -> list[dict[str, Any]]:
        """Return the nodes that are alive, as `ray.nodes`, which would wait for a lost head."""
        client = self.ray._private.worker.global_worker.gcs_client  # noqa: SLF001 - with a time-out
        try:
            nodes = client.get_all_node_info(timeout=_ANSWER_SECONDS)
        except self.ray.exceptions.RpcError as error:
            raise EvaluatorUnavailable(
                f"the head of the cluster does not list its nodes: {_first_line(error)}"
            ) from error
        return [
            {"NodeID": node_id.hex(), "Resources": dict(info.resources_total)}
            for node_id, info in nodes.items()
            if info.state == _ALIVE
        ]

    def close(self) -> None:
        """Disconnect; a local cluster ends and its files are removed. Idempotent."""
        with suppress(Exception):
            self.ray.shutdown()
        if self.node is not None:
            self.node.close()
        if self.directory is not None:
            shutil.rmtree(self.directory, ignore_errors=True)


def open_ray(address: str | None = None, *, cpus: int | None = None) -> RaySession:
    """Start a local cluster, or connect to the one at an address.

    A local cluster ends with the thread that has opened it. address: `host:port` of a cluster's
    head, which this process joins as a node without CPUs unless one runs here; or `auto` for the
    cluster that has a node here.
    """
    for name, value in _BEFORE_IMPORT.items():
        os.environ.setdefault(name, value)
    if address and (os.environ.get("RAY_AUTH_TOKEN") or os.environ.get("RAY_AUTH_TOKEN_PATH")):
        # Ray does not send a token without this.
        os.environ.setdefault("RAY_AUTH_MODE", "token")
    # What its import and start warn of, a user cannot act on.
    with warnings.catch_warnings(action="ignore"):
        try:
            import ray  # noqa: PLC0415 - its environment had to be set first
        except ImportError as error:
            raise EvaluatorUnavailable(
                f"Ray cannot be imported: {_first_line(error)}; reinstall it, or use the in-process"
                " evaluator"
            ) from error

        if ray.is_initialized():
            raise EvaluatorUnavailable("this process has a connection to Ray already")
        # By default it prints to standard output, which is for a command's answers.
        printer: Any = ray._private.worker  # noqa: SLF001 - there is no other way
        printer.print_to_stdstream = _log_lines
        return _connect(ray, address) if address else _embed(ray, cpus or available_cpus())


def _log_lines(message: Mapping[str, Any], **_: object) -> None:
    """Log what a raylet prints, such as the end of a worker."""
    for line in message["lines"]:
        _log.info("%s: %s", message["pid"], line)


def _connect(ray: ModuleType, address: str) -> RaySession:
    host, _, port = address.rpartition(":")
    host = host.strip("[]")
    if port.isdecimal() and not listens(host, int(port)):
        # Ray would try for minutes without a message.
        raise EvaluatorUnavailable(f"no Ray cluster listens at {address!r}; is it up?")
    node = None
    if port.isdecimal() and not comes_here(host, int(port)):
        node = JoinedNode(address)
    try:
        ray.init(address=address, log_to_driver=False, logging_level="ERROR")
        session = RaySession(ray, _head(ray), node=node)
        session.nodes()
    except Exception as error:
        with suppress(Exception):
            ray.shutdown()
        if node is not None:
            node.close()
        raise EvaluatorUnavailable(
            f"no Ray cluster answers at {address!r}: {_first_line(error)}; check the address, and"
            " that RAY_AUTH_TOKEN is the cluster's"
        ) from error
    return session


def _embed(ray: ModuleType, cpus: int) -> RaySession:
    _sweep()
    directory = Path(tempfile.mkdtemp(prefix=f"{_PREFIX}{os.getpid()}-", dir=_short_directory()))
    options: dict[str, Any] = {
        "address": "local",
        "num_cpus": cpus,
        "num_gpus": 0,
        "include_dashboard": False,
        "object_store_memory": OBJECT_STORE_BYTES,
        "log_to_driver": False,
        "logging_level": "ERROR",
        "_temp_dir": str(directory),
    }
    try:
        # Workers inherit the environment that the cluster was started in.
        with _environment(WORKER_ENVIRONMENT | _import_path() | _token()), _bare(ray):
            ray.init(**options)
    except Exception as error:
        with suppress(Exception):
            ray.shutdown()
        shutil.rmtree(directory, ignore_errors=True)
        raise EvaluatorUnavailable(
            f"Ray cannot be started on this machine: {_first_line(error)}; use the in-process"
            " evaluator, or a writable directory for temporary files (TMPDIR)"
        ) from error
    return RaySession(ray, _head(ray), directory)


def _head(ray: ModuleType) -> tuple[str, int]:
    host, _, port = str(ray.get_runtime_context().gcs_address).rpartition(":")
    return host.strip("[]"), int(port)


def listens(host: str, port: int, *, timeout: float = 2.0) -> bool:
    try:
        with socket.create_connection((host, port), timeout=timeout):
            return True
    except OSError:
        return False


def _import_path() -> dict[str, str]:
    """Variables with which workers find these packages, installed or not."""
    root = str(Path(__file__).parents[3])
    given = os.environ.get("PYTHONPATH", "")
    return {"PYTHONPATH": os.pathsep.join([root, *filter(None, [given])])}


@cache
def _token() -> dict[str, str]:
    """A secret of this process, read once by Ray, so that none is kept in the home directory."""
    if os.environ.get("RAY_AUTH_TOKEN") or os.environ.get("RAY_AUTH_TOKEN_PATH"):
        return {}
    return {"RAY_AUTH_TOKEN": secrets.token_hex(32)}


def _short_directory() -> str:
    """A directory for sockets: their paths have 107 bytes, and Ray appends some seventy."""
    chosen = tempfile.gettempdir()
    usable = len(chosen) <= 16 or not os.access("/tmp", os.W_OK)  # noqa: S108 - mkdtemp follows
    return chosen if usable else "/tmp"  # noqa: S108


def _sweep() -> None:
    """Remove the files of processes that were killed, on systems that list processes."""
    for directory in Path(_short_directory()).glob(f"{_PREFIX}*-*"):
        pid = directory.name.removeprefix(_PREFIX).split("-")[0]
        if Path("/proc/self").exists() and not Path("/proc", pid).exists():
            shutil.rmtree(directory, ignore_errors=True)


@contextmanager
def _environment(values: Mapping[str, str]) -> Iterator[None]:
    """Set variables for processes started inside the block."""
    before = {name: os.environ.get(name) for name in values}
    os.environ.update(values)
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value


@contextmanager
def _bare(ray: ModuleType) -> Iterator[None]:
    """Start no dashboard, autoscaler or log monitor: they take as long to start as the workers."""
    node = ray._private.node.Node  # noqa: SLF001 - there is no other way
    unused = {name: vars(node)[name] for name in _UNUSED if name in vars(node)}
    for name in unused:
        setattr(node, name, lambda *_, **__: None)
    try:
        yield
    finally:
        for name, start in unused.items():
            setattr(node, name, start)


def _first_line(error: BaseException) -> str:
    text = str(error).strip() or type(error).__name__
    return text.splitlines()[0]
