"""Servers on free ports of this machine: one in a thread, one as users start it."""

from __future__ import annotations

import json
import struct
import sys
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from importlib import import_module
from pathlib import Path
from typing import Any, Final, cast

import httpx2
import numpy as np
from fastapi import FastAPI
from fastapi.routing import APIRoute
from numpy.typing import NDArray

from gaitswarm.api import dependencies
from gaitswarm.api.app import create_app
from gaitswarm.api.server import ApiServer
from gaitswarm.services.monitoring.activity import Activity
from gaitswarm.services.monitoring.metrics import Metrics
from gaitswarm.services.optimizer.service import JobService
from gaitswarm.settings import Settings
from tests.examples.api_document import api_document
from tests.examples.forked import ForkedCommand
from tests.examples.processes import line_with, output

# pytest rewrites this module of a plug-in, which may fail in a server's thread: CPython 3.11 parses
# in one thread at a time.
import_module("anyio._backends._asyncio")

QUICK_EVENTS: Final = {"GAITSWARM_API_EVENT_POLL_SECONDS": "0.1"}


class Served:
    """A server's jobs, by its client."""

    client: httpx2.Client

    def submit(self, spec: dict[str, Any]) -> str:
        """Id of a new job."""
        answer = self.client.post("/v1/jobs", json=spec)
        assert answer.status_code == 202, answer.text
        return str(answer.json()["id"])

    def job(self, job_id: str) -> dict[str, Any]:
        """A job as it is now."""
        return dict(self.client.get(f"/v1/jobs/{job_id}").json())

    def wait_for(self, job_id: str, state: str, *, seconds: float = 120.0) -> dict[str, Any]:
        """A job once it is in a state; fails if it ends in another one."""
        ends = time.monotonic() + seconds
        while (job := self.job(job_id))["state"] != state:
            assert job["state"] not in ("failed", "cancelled"), job["error"]
            assert time.monotonic() < ends, f"the job is {job['state']} still ({job['waiting']})"
            time.sleep(0.1)
        return job


class Server(Served):
    """The API in a thread of this process, and a client of it.

    page_folder, manual_folder: of the built page and manual; by default there is none, whether one
        was built here or not.
    """

    def __init__(
        self,
        service: JobService | None,
        *,
        page_folder: Path = Path("none"),
        manual_folder: Path = Path("none"),
        metrics: Metrics | None = None,
        components: Sequence[dependencies.Component] = (),
        drain: Callable[[threading.Event], None] = lambda _: None,
        activity: Activity | None = None,
        **settings: Any,
    ) -> None:
        assert set(settings) <= set(Settings.model_fields)
        values = Settings(**{"api_port": 0, "api_event_poll_seconds": 0.02, **settings})
        self.app = create_app(
            cast(JobService, service),
            settings=values,
            page_folder=page_folder,
            manual_folder=manual_folder,
            metrics=metrics,
            components=components,
            activity=activity,
        )
        self._server = ApiServer(self.app, values, drain=drain, log_level="critical")
        self._thread = threading.Thread(target=self._server.run)
        self._thread.start()
        self.url = self._server.url
        self.client = httpx2.Client(base_url=self.url, timeout=20.0, verify=False)

    def serve(self, service: JobService) -> None:
        """Serve the jobs of another database from now on."""
        self.app.state.service = service

    def stop(self) -> None:
        """Let it begin to stop."""
        self._server.stop()

    def close(self) -> None:
        """Stop it, and wait until it has."""
        self.stop()
        self.client.close()
        self._thread.join(timeout=60.0)
        assert not self._thread.is_alive()


class ServerProcess(Served):
    """`gaitswarm serve` as a process, with a runner by default, and a client of it.

    database: a file, or a URL. environment: added to this process's.
    """

    def __init__(
        self,
        database: Path | str,
        *options: str,
        environment: Mapping[str, str] = QUICK_EVENTS,
    ) -> None:
        chosen = options or ("--evaluator", "in-process")
        self.process = ForkedCommand(
            *("serve", "--db", str(database), "--port", "0", *chosen),
            environment=environment,
            stdout=None,
        )
        self.url = line_with(self.process.stderr, r"serves (http://[\d.:]+) and")[1]
        self.client = httpx2.Client(base_url=self.url, timeout=60.0, verify=False)
        # A full pipe would stop the server.
        self._said = ""
        self._drain = threading.Thread(target=self._listen)
        self._drain.start()

    def _listen(self) -> None:
        self._said = output(self.process.stderr).read()

    def close(self) -> None:
        """Let it end. What it said is shown with the test that fails."""
        self.client.close()
        self.process.terminate()
        try:
            self.process.wait(timeout=60.0)
        finally:
            self.process.kill()
            self._drain.join()
            output(self.process.stderr).close()
            sys.stderr.write(self._said)


def operations(app: FastAPI) -> list[APIRoute]:
    """All operations under /v1, with what each depends on."""
    found = [route for route in app.routes if isinstance(route, APIRoute)]
    documented = [method for item in api_document()["paths"].values() for method in item]
    assert len(found) == len(documented)
    return found


def unframed(content: bytes) -> tuple[dict[str, Any], NDArray[np.float32]]:
    """Header and numbers of a binary answer, as docs/reference/http.md says."""
    (length,) = struct.unpack_from("<I", content)
    assert length % 4 == 0
    header = json.loads(content[4 : 4 + length])
    return header, np.frombuffer(content, dtype="<f4", offset=4 + length)
