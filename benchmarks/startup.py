"""Waiting times from the key press to the first simulation, the result, the prompt, the page.

    python -m benchmarks.startup [--rounds 3] [--iterations 25] [--json]

Every measurement is a process of its own with a database of its own; commands take turns, and the
table has the least of all rounds [s]. `warm` has compiled kernels in the cache, `cold` an empty
cache each time. The first walk is when a kernel is first called. `prompt` is from the last byte of
the result to the end of the process; `stopped` from Ctrl-C to the end of a server.
"""

from __future__ import annotations

import argparse
import json
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections import defaultdict
from collections.abc import Mapping, Sequence
from pathlib import Path

import httpx2

COMMAND = "from gaitswarm.cli.main import main; main()"

# Notes when a kernel is first called: the clock is the same for all processes of a machine.
WALK = f"""
import sys, time
from gaitswarm.sim.kernel.native import NativeKernel
walk = NativeKernel.walk
def first(*arguments, **options):
    NativeKernel.walk = walk
    print("first walk", time.monotonic(), file=sys.stderr, flush=True)
    return walk(*arguments, **options)
NativeKernel.walk = first
{COMMAND}
"""

HELP: tuple[list[str], ...] = ([], ["optimize"], ["serve"], ["db", "backup"])


def shown(arguments: Sequence[str]) -> float:
    """Seconds until a command has ended."""
    begun = time.monotonic()
    subprocess.run([sys.executable, "-c", COMMAND, *arguments], check=True, capture_output=True)
    return time.monotonic() - begun


def optimized(folder: Path, cache: Mapping[str, str], iterations: int) -> dict[str, float]:
    """Seconds to the first walk, the result, and from there to the prompt, of one job."""
    command = [
        *(sys.executable, "-c", WALK, "optimize", "--db", str(folder / "job.db"), "--json"),
        *("--particles", "25", "--iterations", str(iterations), "--seed", "1"),
    ]
    said = folder / "said"
    begun = result = time.monotonic()
    with (
        said.open("w") as errors,
        subprocess.Popen(
            command, env=os.environ | cache, stdout=subprocess.PIPE, stderr=errors
        ) as process,
    ):
        assert process.stdout is not None
        # The last block that comes is the end of the result.
        while os.read(process.stdout.fileno(), 1 << 20):
            result = time.monotonic()
    ended = time.monotonic()
    assert process.returncode == 0, said.read_text()
    (line,) = [x for x in said.read_text().splitlines() if x.startswith("first walk")]
    return {
        "first walk": float(line.split()[2]) - begun,
        "result": result - begun,
        "prompt": ended - result,
    }


def served(folder: Path) -> dict[str, float]:
    """Seconds until a server says that it is ready, and until it has stopped."""
    begun = time.monotonic()
    with subprocess.Popen(
        [sys.executable, "-c", COMMAND, "serve", "--port", "0", "--db", str(folder / "jobs.db")],
        stderr=subprocess.PIPE,
        text=True,
    ) as process:
        assert process.stderr is not None
        line = next(line for line in process.stderr if "http://" in line)
        (url,) = [
            word for word in line.split() if word.startswith("http://") and "docs" not in word
        ]
        while not ready(url):
            time.sleep(0.005)
        taken = time.monotonic() - begun
        stopping = time.monotonic()
        process.send_signal(signal.SIGINT)
        process.communicate()
    return {"ready": taken, "stopped": time.monotonic() - stopping}


def ready(url: str) -> bool:
    """Whether a server answers that it is."""
    try:
        return httpx2.get(f"{url}/v1/readyz").status_code == 200
    except httpx2.TransportError:
        return False


def measured(iterations: int) -> dict[str, float]:
    """One round of everything."""
    found = {" ".join(["gaitswarm", *of, "--help"]): shown([*of, "--help"]) for of in HELP}
    for name in ("warm", "cold"):
        with tempfile.TemporaryDirectory() as made:
            folder = Path(made)
            cache = {"XDG_CACHE_HOME": str(folder / "cache")} if name == "cold" else {}
            for what, seconds in optimized(folder, cache, iterations).items():
                found[f"optimize, {name}: {what}"] = seconds
    with tempfile.TemporaryDirectory() as made:
        for what, seconds in served(Path(made)).items():
            found[f"serve: {what}"] = seconds
    return found


def main() -> None:
    """Print a table, or JSON."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--iterations", type=int, default=25)
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args()
    rounds: dict[str, list[float]] = defaultdict(list)
    # What is not compiled yet would make the first warm start a cold one.
    subprocess.run(
        [sys.executable, "-c", "import gaitswarm.sim.simulate as s; s.prepare()"], check=True
    )
    for _ in range(options.rounds):
        for name, seconds in measured(options.iterations).items():
            rounds[name].append(seconds)
    least = {name: min(seconds) for name, seconds in rounds.items()}
    if options.json:
        print(json.dumps(least, indent=2))
        return
    for name, seconds in least.items():
        print(f"{name:32} {seconds:7.2f}")


if __name__ == "__main__":
    main()
