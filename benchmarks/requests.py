"""Latency of requests and event streams next to a running job.

    python -m benchmarks.requests [--seconds 60] [--rate 20] [--streams 50] [--jobs 200]

Starts `gaitswarm serve` on a new SQLite database with finished jobs and one that runs in its
process, opens the streams, and sends requests at a fixed rate. Latency counts from the
time at which a request was due. Memory is what the server holds at ten times of the run.
"""

from __future__ import annotations

import argparse
import asyncio
import resource
import subprocess
import sys
import tempfile
import time
from collections import defaultdict
from pathlib import Path

import httpx2
import numpy as np

SMALL = {"scenarios": ["normal-fast"], "optimizer": {"particles": 4}, "iterations": 2}
LONG = {"name": "running", "optimizer": {"particles": 25}, "iterations": 100_000}


def start(folder: str) -> tuple[subprocess.Popen[str], str]:
    """Start a server, and return it with its URL."""
    log = Path(folder) / "log"
    with log.open("w") as stream:
        command = [sys.executable, "-m", "gaitswarm", "serve", "--evaluator", "in-process"]
        command += ["--db", f"{folder}/jobs.db", "--port", "0"]
        process = subprocess.Popen(command, stderr=stream, text=True)
    while " serves " not in (text := log.read_text()):
        if process.poll() is not None:
            raise SystemExit(text)
        time.sleep(0.1)
    return process, text.split(" serves ")[1].split()[0]


def fill(client: httpx2.Client, jobs: int) -> str:
    """Finish jobs, start a long one, and return its id once it has committed iterations."""
    ids = []
    for number in range(jobs):
        answer = client.post("/v1/jobs", json={**SMALL, "name": f"job {number}"})
        ids.append(answer.raise_for_status().json()["id"])
    for job_id in ids:
        while client.get(f"/v1/jobs/{job_id}").json()["state"] not in ("succeeded", "failed"):
            time.sleep(0.5)
    running = str(client.post("/v1/jobs", json=LONG).raise_for_status().json()["id"])
    while client.get(f"/v1/jobs/{running}").json()["iterations"] < 3:
        time.sleep(0.2)
    return running


async def follow(client: httpx2.AsyncClient, job_id: str, events: list[int]) -> None:
    """Count the events of a stream until it is cancelled."""
    path = f"/v1/jobs/{job_id}/events"
    async with client.stream("GET", path, timeout=None) as answer:
        async for line in answer.aiter_lines():
            events[0] += line.startswith("event:")


def memory(pid: int) -> float:
    """Return the resident memory of a process [MB]."""
    pages = int(Path(f"/proc/{pid}/statm").read_text().split()[1])
    return pages * resource.getpagesize() / 1e6


async def measure(url: str, job_id: str, pid: int, options: argparse.Namespace) -> None:
    """Print the number of requests, quantiles of their latency by path, and the server's memory."""
    job = f"/v1/jobs/{job_id}"
    paths = [
        *("/v1/jobs", "/v1/jobs?order=name", "/v1/jobs?search=job+7", "/v1/job-facets"),
        *(job, f"{job}/best", f"{job}/iterations", f"{job}/iterations/0/evaluations"),
    ]
    latencies: dict[str, list[float]] = defaultdict(list)
    events = [0]
    limits = httpx2.Limits(max_connections=None)
    async with httpx2.AsyncClient(base_url=url, timeout=30.0, limits=limits) as client:
        following = [follow(client, job_id, events) for _ in range(options.streams)]
        streams = list(map(asyncio.create_task, following))
        await asyncio.sleep(1.0)

        async def ask(path: str, due: float) -> None:
            (await client.get(path)).raise_for_status()
            latencies[path].append(time.perf_counter() - due)

        begun = time.perf_counter()
        requests, held = [], [memory(pid)]
        count = int(options.seconds * options.rate)
        for number in range(count):
            if number * 10 // count == len(held):
                held.append(memory(pid))
            due = begun + number / options.rate
            await asyncio.sleep(max(0.0, due - time.perf_counter()))
            requests.append(asyncio.create_task(ask(paths[number % len(paths)], due)))
        await asyncio.gather(*requests)
        held.append(memory(pid))
        for stream in streams:
            stream.cancel()
    everything = {**latencies, "all": [s for some in latencies.values() for s in some]}
    for path, seconds in everything.items():
        p50, p99, longest = 1e3 * np.quantile(seconds, [0.5, 0.99, 1.0])
        name = path.replace(job_id, "ID")
        print(f"{name:40} {len(seconds):6} p50 {p50:6.1f} p99 {p99:6.1f} max {longest:6.1f} ms")
    print(f"events received: {events[0]}")
    print(f"memory: {' '.join(f'{size:.0f}' for size in held)} MB")


def main() -> None:
    """Measure once."""
    parser = argparse.ArgumentParser(description=__doc__)
    for name, default in (("seconds", 60.0), ("rate", 20.0), ("streams", 50), ("jobs", 200)):
        parser.add_argument(f"--{name}", type=type(default), default=default)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        process, url = start(folder)
        try:
            with httpx2.Client(base_url=url, timeout=60.0) as client:
                job_id = fill(client, options.jobs)
            asyncio.run(measure(url, job_id, process.pid, options))
        finally:
            process.terminate()
            process.wait(timeout=90.0)


if __name__ == "__main__":
    main()
