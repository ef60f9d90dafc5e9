"""Ray, started inside this process's lifetime or found by its address; quiet in both cases."""

from __future__ import annotations

import logging
import os
import platform
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
from gaitswarm.services.worker.in_process import available_cpus
from gaitswarm.services.worker.joining import JoinedNode, comes_here

_log = logging.getLogger(__name__)

_OBJECT_STORE_BYTES: Final = 80 * 1024 * 1024
"""Ray's minimum is 75 MiB; designs and results take kilobytes."""

_ANSWER_SECONDS: Final = 2.0
"""In which a head says which nodes there are."""

_ALIVE: Final = 0
"""Of Ray's states of nodes."""

_PREFIX: Final = "gaitswarm-ray-"

_BEFORE_IMPORT: Final = {
    "RAY_USAGE_STATS_ENABLED": "0",
    # Ray must not package the checkout and install it anew when we run under `uv run`.
    "RAY_ENABLE_UV_RUN_RUNTIME_ENV": "0",
    # Its handler of signals takes SIGTERM away from us, for good when a connection is closed.
    "RAY_DISABLE_FAILURE_SIGNAL_HANDLER": "1",
    # The behaviour that later versions have in any case; without it, init warns.
    "RAY_ACCEL_ENV_VAR_OVERRIDE_ON_ZERO": "0",
    # Where nobody asks what became of a task any more, as when we close, nobody is to be told.
    "RAY_IGNORE_UNHANDLED_ERRORS": "1",
}

_UNUSED: Final = ("start_api_server", "start_monitor", "start_log_monitor")
"""What starts processes of a head that an embedded cluster does without."""

WORKER_ENVIRONMENT: Final = {
    # The slots are the parallelism.
    "OMP_NUM_THREADS": "1",
    "OPENBLAS_NUM_THREADS": "1",
    "MKL_NUM_THREADS": "1",
    # Each worker asks for its metrics agent otherwise, and there is none.
    "RAY_enable_metrics_collection": "0",
}


@dataclass(slots=True)
class RaySession:
    """A connection to Ray.

    Attributes:
        ray: The module, imported by `open_ray`.
        slots: CPUs of the cluster, when it was opened.
        head: Where its control service listens.
        directory: Files of an embedded cluster.
        node: This process's own node of a cluster, where no other one runs on this machine.
    """

    ray: ModuleType
    slots: int
    head: tuple[str, int]
    directory: Path | None = None
    node: JoinedNode | None = None

    def head_answers(self) -> bool:
        """Whether the control service takes connections.

        Ray itself waits a minute for it and then ends the process, without a word to us.
        """
        return listens(*self.head)

    def nodes(self) -> list[dict[str, Any]]:
        """Those that are alive, as `ray.nodes` has them, or an error within two seconds.

        `ray.nodes` waits for a head that goes meanwhile for as long as it takes; after a minute Ray
        ends the process for that, connected or not.

        Raises:
            EvaluatorUnavailable: The head does not answer.
        """
        return _nodes(self.ray)

    def only_on(self, node_id: str) -> Any:
        """How a task is scheduled on one node, and fails if that is gone.

        Args:
            node_id: Ray's.

        Returns:
            For the option `scheduling_strategy`.
        """
        from ray.util import scheduling_strategies  # noqa: PLC0415 - as in `open_ray`

        return scheduling_strategies.NodeAffinitySchedulingStrategy(node_id, soft=False)

    def near_head(self) -> Any:
        """How an actor is scheduled on the head while there is one, as it outlives other nodes.

        Returns:
            For the option `scheduling_strategy`.
        """
        from ray.util import scheduling_strategies  # noqa: PLC0415 - as in `open_ray`

        heads = [n for n in self.nodes() if "node:__internal_head__" in n["Resources"]]
        if not heads:
            return "DEFAULT"
        head = str(heads[0]["NodeID"])
        return scheduling_strategies.NodeAffinitySchedulingStrategy(head, soft=True)

    def close(self) -> None:
        """Disconnect; an embedded cluster ends, and its files are removed. Idempotent."""
        with suppress(Exception):
            self.ray.shutdown()
        if self.node is not None:
            self.node.close()
        if self.directory is not None:
            shutil.rmtree(self.directory, ignore_errors=True)


def open_ray(address: str | None = None, *, cpus: int | None = None) -> RaySession:
    """Start an embedded cluster, or connect to the one at an address.

    An embedded cluster dies with the thread that opened it, so that must be one that stays. The
    process's signals stay as they are, here and when the session is closed.

    Args:
        address: None to embed. `host:port` of a cluster's head; this process becomes a node of the
            cluster, without CPUs, unless one runs on this machine. `auto` for the cluster that
            has a node here.
        cpus: Slots of an embedded cluster; all of this machine's by default.

    Returns:
        The session; whoever opens it closes it.

    Raises:
        EvaluatorUnavailable: Neither is possible; says what to do.
    """
    for name, value in _BEFORE_IMPORT.items():
        os.environ.setdefault(name, value)
    if address and (os.environ.get("RAY_AUTH_TOKEN") or os.environ.get("RAY_AUTH_TOKEN_PATH")):
        # A token is not shown to a cluster unless it is asked for.
        os.environ.setdefault("RAY_AUTH_MODE", "token")
    with _quiet():
        try:
            import ray  # noqa: PLC0415 - its environment had to be set first
        except ImportError as error:
            raise EvaluatorUnavailable(
                f"Ray cannot be imported: {_first_line(error)}; install it anew, or use the"
                " in-process evaluator instead"
            ) from error

        if ray.is_initialized():
            raise EvaluatorUnavailable("this process has a connection to Ray already")
        # Its own goes in colours to standard output, which is for a command's answers.
        printer: Any = ray._private.worker  # noqa: SLF001 - there is no other way
        printer.print_to_stdstream = _pass_on
        return _connect(ray, address) if address else _embed(ray, cpus or available_cpus())


def _pass_on(told: Mapping[str, Any], **_: object) -> None:
    """Log what a raylet tells, of workers that died, say."""
    for line in told["lines"]:
        _log.info("%s: %s", told["pid"], line)


def _connect(ray: ModuleType, address: str) -> RaySession:
    host, _, port = address.rpartition(":")
    host = host.strip("[]")
    if port.isdecimal() and not listens(host, int(port)):
        # Ray would try for minutes, and so long nobody could see what is wrong.
        raise EvaluatorUnavailable(f"no Ray cluster listens at {address!r}; is it up?")
    node = None
    if port.isdecimal() and not comes_here(host, int(port)):
        node = JoinedNode(address)
    try:
        ray.init(address=address, log_to_driver=False, logging_level="ERROR")
        slots = int(sum(n["Resources"].get("CPU", 0) for n in _nodes(ray)))
    except Exception as error:
        with suppress(Exception):
            ray.shutdown()
        if node is not None:
            node.close()
        raise EvaluatorUnavailable(
            f"no Ray cluster answers at {address!r}: {_first_line(error)}; check the address, and"
            " that RAY_AUTH_TOKEN is the cluster's"
        ) from error
    return RaySession(ray, max(slots, 1), _head(ray), node=node)


def _nodes(ray: ModuleType) -> list[dict[str, Any]]:
    client = ray._private.worker.global_worker.gcs_client  # noqa: SLF001 - with a time-out
    try:
        found = client.get_all_node_info(timeout=_ANSWER_SECONDS)
    except ray.exceptions.RpcError as error:
        raise EvaluatorUnavailable(
            f"the head of the cluster does not say which nodes there are: {_first_line(error)}"
        ) from error
    return [
        {
            "NodeID": node_id.hex(),
            "NodeManagerHostname": info.node_manager_hostname,
            "NodeManagerAddress": info.node_manager_address,
            "NodeManagerPort": info.node_manager_port,
            "Resources": dict(info.resources_total),
        }
        for node_id, info in found.items()
        if info.state == _ALIVE
    ]


def _embed(ray: ModuleType, cpus: int) -> RaySession:
    _sweep()
    directory = Path(tempfile.mkdtemp(prefix=f"{_PREFIX}{os.getpid()}-", dir=_short_directory()))
    options: dict[str, Any] = {
        "address": "local",
        "num_cpus": cpus,
        "num_gpus": 0,
        "include_dashboard": False,
        "object_store_memory": _OBJECT_STORE_BYTES,
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
            " evaluator instead, or a directory for temporary files (TMPDIR) that can be written"
        ) from error
    return RaySession(ray, cpus, _head(ray), directory)


def _head(ray: ModuleType) -> tuple[str, int]:
    host, _, port = str(ray.get_runtime_context().gcs_address).rpartition(":")
    return host.strip("[]"), int(port)


def listens(host: str, port: int, *, timeout: float = 2.0) -> bool:
    """Whether anything takes connections at an address.

    Args:
        host: Name or address of a machine.
        port: TCP port.
        timeout: How long an answer may take [s].
    """
    try:
        with socket.create_connection((host, port), timeout=timeout):
            return True
    except OSError:
        return False


def _import_path() -> dict[str, str]:
    """Lets workers find our packages, installed or not."""
    root = str(Path(__file__).parents[3])
    given = os.environ.get("PYTHONPATH", "")
    return {"PYTHONPATH": os.pathsep.join([root, *filter(None, [given])])}


@cache
def _token() -> dict[str, str]:
    """A secret of our own, so that none is looked for, or left, in the home directory.

    One for all clusters of this process, because Ray reads it once.
    """
    if os.environ.get("RAY_AUTH_TOKEN") or os.environ.get("RAY_AUTH_TOKEN_PATH"):
        return {}
    return {"RAY_AUTH_TOKEN": secrets.token_hex(32)}


def _short_directory() -> str:
    """Sockets have paths of 107 bytes at most, and Ray appends some seventy."""
    chosen = tempfile.gettempdir()
    usable = len(chosen) <= 16 or not os.access("/tmp", os.W_OK)  # noqa: S108 - mkdtemp follows
    return chosen if usable else "/tmp"  # noqa: S108


def _sweep() -> None:
    """Remove what processes left that were killed before they could."""
    for directory in Path(_short_directory()).glob(f"{_PREFIX}*-*"):
        pid = directory.name.removeprefix(_PREFIX).split("-")[0]
        if pid.isdecimal() and not _alive(int(pid)):
            shutil.rmtree(directory, ignore_errors=True)


def _alive(pid: int) -> bool:
    if platform.system() == "Windows":  # where signal 0 is Ctrl-C
        return True
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    except OSError:
        return True
    return True


@contextmanager
def _environment(values: Mapping[str, str]) -> Iterator[None]:
    """Set variables for the processes started inside, and put back what was there."""
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
    """Start no processes that walks have no use for: of the dashboard, of autoscaling, of logs.

    They take as long to start as the workers. Of `ray.init` no option leaves them out. A Ray that
    has them by other names starts them.
    """
    node = ray._private.node.Node  # noqa: SLF001 - there is no other way
    unused = {name: vars(node)[name] for name in _UNUSED if name in vars(node)}
    for name in unused:
        setattr(node, name, lambda *_, **__: None)
    try:
        yield
    finally:
        for name, start in unused.items():
            setattr(node, name, start)


@contextmanager
def _quiet() -> Iterator[None]:
    """Ray's import and start warn of things that are not its user's to change."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        yield


def _first_line(error: BaseException) -> str:
    text = str(error).strip() or type(error).__name__
    return text.splitlines()[0]
