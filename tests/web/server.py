"""`gaitswarm serve` as a process, with the few requests that the tests make themselves."""

from __future__ import annotations

import os
import re
import subprocess
import sys
import threading
import time
from pathlib import Path
from typing import Any

import httpx2

ROOT = Path(__file__).parents[2]


class ServerProcess:
    """On a free port, with a runner unless told otherwise.

    url, client: of the server.
    """

    def __init__(self, database: Path, *options: str) -> None:
        chosen = options or ("--evaluator", "in-process")
        program = "from cli.main import main; main()"
        self._process = subprocess.Popen(
            [
                sys.executable,
                *("-u", "-c", program, "serve", "--db", str(database), "--port", "0"),
                *chosen,
            ],
            stderr=subprocess.PIPE,
            text=True,
            env=os.environ | {"PYTHONPATH": str(ROOT), "GAITSWARM_API_EVENT_POLL_SECONDS": "0.1"},
        )
        self.url = self._announced()
        self.client = httpx2.Client(base_url=self.url, timeout=60.0)
        # A full pipe would stop the server.
        self._drain = threading.Thread(target=self._process.stderr.read)
        self._drain.start()

    def submit(self, spec: dict[str, Any]) -> str:
        answer = self.client.post("/v1/jobs", json=spec)
        assert answer.status_code == 202, answer.text
        return str(answer.json()["id"])

    def job(self, job_id: str) -> dict[str, Any]:
        return dict(self.client.get(f"/v1/jobs/{job_id}").json())

    def wait_for(self, job_id: str, state: str, *, seconds: float = 120.0) -> dict[str, Any]:
        ends = time.monotonic() + seconds
        while (job := self.job(job_id))["state"] != state:
            assert job["state"] not in ("failed", "cancelled"), job["error"]
            assert time.monotonic() < ends, f"the job is {job['state']} still"
            time.sleep(0.1)
        return job

    def close(self) -> None:
        self.client.close()
        self._process.terminate()
        try:
            self._process.wait(timeout=60.0)
        finally:
            self._process.kill()
            self._drain.join()
            self._process.stderr.close()

    def _announced(self) -> str:
        seen = []
        for line in self._process.stderr:
            seen.append(line)
            found = re.search(r"serves (http://[\d.:]+) and", line)
            if found:
                return found[1]
        raise AssertionError(f"the server did not start: {seen}")
