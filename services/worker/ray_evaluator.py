"""Simulations as tasks of Ray, on this machine or on a cluster"""

from __future__ import annotations

import logging
import os
import secrets
import shutil
import socket
import tempfile
import threading
import time
import warnings
from collections import OrderedDict, deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Future
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from types import ModuleType
from typing import Any, Final

from gaitswarm.services.optimizer.errors import EvaluatorUnavailable
from gaitswarm.services.optimizer.run.evaluator import EvaluationRequest, EvaluationStopped
from gaitswarm.services.worker import dispatch, tasks
from gaitswarm.services.worker.ray_node import OBJECT_STORE_BYTES, JoinedNode, comes_here
from gaitswarm.sim.outcome import Outcome

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
        return _connect(ray, address) if address else _embed(ray, cpus or dispatch.available_cpus())


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


PULSE_SECONDS: Final = 4.0
"""Interval at which the cluster's head is checked; three failures count as lost."""

EMPTY_SECONDS: Final = 20.0
"""Time without CPUs after which requests fail with EvaluatorUnavailable, and their jobs wait."""

_LOOK_SECONDS: Final = 1.0
"""Interval at which nodes are counted."""

_GRACE_SECONDS: Final = 1.0
"""Time that an abandoned task has to end before it is cancelled; most end in this time."""

_CLOSE_SECONDS: Final = 30.0
"""Longest time to wait for a connection that is closed."""

_RECONNECT_SECONDS: Final = 5.0
"""Interval of attempts to reach a cluster that is away."""

_TASKS_PER_LOOK: Final = 64
"""Submitted tasks for each that must be finished before the next look, so that looks are few."""

_SHARED: Final = 64
"""Number of jobs whose cases stay in the object store."""


class RayEvaluator:
    """`Evaluator` on Ray, which is opened in the background, and again if it is lost."""

    def __init__(self, address: str | None = None, *, cpus: int | None = None) -> None:
        self._address = address
        self._cpus = cpus
        self._changing = threading.Lock()
        self._closing = threading.Event()
        self._dispatcher = dispatch.Dispatcher()
        self._connection = _Connection(address, cpus)

    @property
    def slots(self) -> int:
        """CPUs of the cluster; 0 before it is open, unless it is local."""
        return self._connection.slots

    @property
    def place(self) -> str:
        workers, nodes = self._connection.slots, self._connection.nodes
        plural = "" if workers == 1 else "s"
        return f"ray: {workers} worker{plural} on {nodes} node{'' if nodes == 1 else 's'}"

    @property
    def loads(self) -> dict[str, dispatch.Load]:
        return {"ray": self._dispatcher.load(self._connection.slots)}

    @property
    def lost(self) -> bool:
        return self._connection.lost

    def trouble(self) -> str | None:
        """Return why Ray cannot be reached; None if it can or is being opened."""
        connection = self._connection
        if not connection.lost:
            return None
        error = connection.opened.exception()
        if error is not None:
            return f"retrying: {error}"
        return "Ray is unreachable; it is opened again for the next iteration"

    def wait_until_open(self, should_stop: Callable[[], bool]) -> None:
        """Return when Ray is open, and close this evaluator if it cannot be."""
        try:
            dispatch.awaited(self._connection.opened, should_stop)
        except (EvaluationStopped, EvaluatorUnavailable):
            self.close()
            raise

    def is_open(self) -> bool:
        """Return whether Ray is open; raise EvaluatorUnavailable if it cannot be opened."""
        connection = self._connection
        if not connection.opened.done():
            return False
        connection.opened.result()
        # A lost connection begins to be opened again.
        return self._living() is connection

    def keep_open(self) -> None:
        """Open Ray again whenever it is lost, in a thread. Returns at once."""
        threading.Thread(target=self._reconnect, name="ray-reconnect", daemon=True).start()

    def _reconnect(self) -> None:
        reported: str | None = None
        while not self._closing.wait(_RECONNECT_SECONDS):
            if self.lost:
                if reported != "away":
                    _log.warning("jobs wait for workers: %s", self.trouble())
                reported = "away"
                with suppress(EvaluatorUnavailable):
                    self._living()
            elif self._connection.opened.done() and reported != "open":
                reported = "open"
                _log.info("Ray is open, with %d slots", self.slots)

    def evaluate(
        self, request: EvaluationRequest, should_stop: Callable[[], bool]
    ) -> tuple[Outcome, ...]:
        """Simulate on Ray, on a new connection if the last one was lost."""
        # Workers of this machine find the kernel in the cache.
        dispatch.build_kernels(request.cases, should_stop)
        connection = self._living()
        dispatch.awaited(connection.opened, should_stop)
        with connection.used():
            return self._dispatcher.evaluate(connection, request, should_stop)

    def close(self) -> None:
        """Disconnect; a local cluster ends. Idempotent."""
        self._closing.set()
        with self._changing:
            self._connection.close()

    def _living(self) -> _Connection:
        """Return a connection that is open or being opened."""
        with self._changing:
            if self._closing.is_set():
                raise EvaluatorUnavailable("the evaluator was closed")
            if self._connection.lost:
                self._connection = _Connection(self._address, self._cpus, after=self._connection)
            return self._connection


class _Connection:
    """One connection to Ray, from opening to loss or closing; an `Engine`.

    One thread opens and closes it, as a local cluster ends with the thread that has started it. A
    process has one connection at a time.
    """

    def __init__(
        self, address: str | None, cpus: int | None, *, after: _Connection | None = None
    ) -> None:
        self.opened: Future[None] = Future()
        self._local = address is None
        self.slots = (cpus or dispatch.available_cpus()) if self._local else 0
        self.nodes = 0
        self._ended: str | None = None
        self._empty_since: float | None = None
        self._closing = threading.Event()
        self._changed = threading.Condition()
        self._users = 0
        self._shared: OrderedDict[str, tuple[tasks.Shared, Any]] = OrderedDict()
        self._abandoned: deque[tuple[float, Any]] = deque()
        self._thread = threading.Thread(
            target=self._live, args=(address, cpus, after), name="ray", daemon=True
        )
        self._thread.start()

    @property
    def lost(self) -> bool:
        """Whether it was lost or closed, or could not be opened; False while it is opened."""
        if not self.opened.done():
            return False
        return self.opened.exception() is not None or self._ended is not None

    @contextmanager
    def used(self) -> Iterator[None]:
        """Keep the connection open inside the block."""
        with self._changed:
            self.check()
            self._users += 1
        try:
            yield
        finally:
            with self._changed:
                self._users -= 1
                self._changed.notify_all()

    def close(self) -> None:
        """Disconnect, and wait until that is done. Idempotent."""
        self._closing.set()
        # Ray cannot be interrupted while it connects to a cluster.
        if not (self._local or self.opened.done()):
            return
        self._thread.join(_CLOSE_SECONDS)
        if self._thread.is_alive():
            _log.warning("Ray did not end within %.0f s", _CLOSE_SECONDS)

    def check(self) -> None:
        """Raise EvaluatorUnavailable if the connection was lost or has no CPUs."""
        if self._ended is not None:
            raise EvaluatorUnavailable(self._ended)
        empty = self._empty_since
        if empty is not None and time.monotonic() - empty > EMPTY_SECONDS:
            raise EvaluatorUnavailable("no node of the Ray cluster has a CPU for simulations")

    def submit(self, request: EvaluationRequest, chunk: dispatch.Chunk, /) -> Any:
        """Submit a task to Ray, which places it and repeats it if its worker dies."""
        cases = chunk.cases
        first = request.cases[cases[0]].name
        name = f"simulate {first}" + (f" and {len(cases) - 1} more" if len(cases) > 1 else "")
        designs = request.designs[chunk.start : chunk.stop]
        with self._reached():
            return self._remote.options(name=name).remote((self._put(request),), cases, designs)

    def wait(self, handles: Sequence[Any], seconds: float) -> Sequence[Any]:
        """Return all finished tasks, some unless the time is over."""
        waiting = list(handles)
        # A look at all tasks takes time in proportion to their number.
        least = 1 + len(waiting) // _TASKS_PER_LOOK
        done: list[Any]
        with self._reached():
            done, _ = self._ray.wait(waiting, num_returns=least, timeout=seconds, fetch_local=False)
            if least == len(done) < len(waiting):
                done, _ = self._ray.wait(
                    waiting, num_returns=len(waiting), timeout=0.0, fetch_local=False
                )
        return done

    def answer(self, handle: Any) -> tasks.Answer:
        exceptions = self._ray.exceptions
        try:
            result: tasks.Answer | tasks.Failure = self._ray.get(handle)
        except exceptions.ObjectLostError as error:
            with self._changed:
                self._shared.clear()
            raise dispatch.TaskLost(str(error)) from error
        except exceptions.RayTaskError as error:
            # The simulation's own errors are results: this worker has not got so far.
            raise dispatch.unlike(
                "the cluster", f"it cannot run this gaitswarm: {error.cause!r}"
            ) from error
        except (exceptions.WorkerCrashedError, exceptions.OutOfMemoryError) as error:
            raise dispatch.WorkerDied from error
        except exceptions.LocalRayletDiedError:
            with self._reached():
                raise
        except exceptions.RayError as error:
            raise dispatch.TaskLost(f"{type(error).__name__}") from error
        if isinstance(result, tasks.Failure):
            raise result.error
        return result

    @contextmanager
    def _reached(self) -> Iterator[None]:
        """Take an error of Ray for the loss of the connection."""
        try:
            yield
        except self._ray.exceptions.RayError as error:
            self._ended = self._ended or f"Ray was lost: {error}"
            raise EvaluatorUnavailable(self._ended) from error

    def abandon(self, handles: Sequence[Any]) -> None:
        """Cancel tasks soon, unless they end by themselves."""
        until = time.monotonic() + _GRACE_SECONDS
        self._abandoned.extend((until, handle) for handle in handles)

    def _put(self, request: EvaluationRequest) -> Any:
        """Put a job's cases into the object store, unless they are there."""
        shared = tasks.Shared(request.cases, request.provenance, tasks.arithmetic_digest())
        with self._changed:
            stored = self._shared.pop(request.job_id, None)
            if stored is None or not _equal(stored[0], shared):
                stored = shared, self._ray.put(shared)
            self._shared[request.job_id] = stored
            # Tasks in progress hold references of their own.
            while len(self._shared) > _SHARED:
                self._shared.popitem(last=False)
            return stored[1]

    def _live(self, address: str | None, cpus: int | None, after: _Connection | None) -> None:
        try:
            if after is not None:
                after.close()
            session = open_ray(address, cpus=cpus)
            self._ray = session.ray
            self._remote = session.ray.remote(num_cpus=1, max_retries=dispatch.MOST_KILLED - 1)(
                tasks.run_in_worker
            )
            self._count(session)
        except BaseException as error:  # noqa: BLE001 - raised again where it is waited for
            self.opened.set_exception(error)
            return
        self.opened.set_result(None)
        try:
            self._watch(session)
        except Exception as error:  # noqa: BLE001 - Ray raises anything when it ends
            _log.info("Ray was lost: %s", error)
            self._ended = f"Ray was lost: {error}"
        else:
            self._ended = "the evaluator was closed"
        # Requests in progress poll `check`.
        with self._changed:
            self._changed.wait_for(lambda: not self._users, _CLOSE_SECONDS)
        session.close()

    def _watch(self, session: RaySession) -> None:
        """Count nodes, check the head and cancel abandoned tasks until the connection ends."""
        misses, next_pulse = 0, time.monotonic() + PULSE_SECONDS
        while not self._closing.wait(_LOOK_SECONDS):
            if not session.raylet_runs():
                raise EvaluatorUnavailable("its raylet has died")
            now = time.monotonic()
            if now >= next_pulse:
                next_pulse = now + PULSE_SECONDS
                misses = 0 if session.head_answers() else misses + 1
                if misses >= 3:
                    raise EvaluatorUnavailable("the head of the cluster does not answer")
            if not misses:
                self._count(session)
            self._cancel(session)

    def _count(self, session: RaySession) -> None:
        with suppress(EvaluatorUnavailable):
            cpus = [int(node["Resources"].get("CPU", 0)) for node in session.nodes()]
            self.slots, self.nodes = sum(cpus), sum(count > 0 for count in cpus)
            if self.slots:
                self._empty_since = None
            elif self._empty_since is None:
                self._empty_since = time.monotonic()

    def _cancel(self, session: RaySession) -> None:
        now = time.monotonic()
        due = []
        while self._abandoned and self._abandoned[0][0] <= now:
            due.append(self._abandoned.popleft()[1])
        if due:
            _, late = session.ray.wait(due, num_returns=len(due), timeout=0.0, fetch_local=False)
            for handle in late:
                # By its end: an interruption could come in the midst of an import.
                session.ray.cancel(handle, force=True)


def _equal(a: tasks.Shared, b: tasks.Shared) -> bool:
    try:
        return a == b
    except ValueError:
        # Cases with arrays have no equality.
        return False
