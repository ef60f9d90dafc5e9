"""The demo's job from start to finish, as a user runs it: wall time and memory.

    python -m benchmarks.job [--rounds 1] [--evaluators ray in-process] [--json]

Every run is a new process with an empty kernel cache and a new database: start-up of Ray and
compilation are part of it. Evaluators take turns. Memory is the largest proportional set size
(PSS, shared pages counted once) of a process among the run's own, sampled twice a second.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

COMMAND = "from gaitswarm.cli.main import main; main()"


def run(evaluator: str) -> dict[str, float | str]:
    """One job; seconds, MiB and the fitness that it found."""
    with tempfile.TemporaryDirectory() as folder:
        command = [
            *(sys.executable, "-c", COMMAND, "optimize", "--json"),
            *("--db", f"{folder}/job.db", "--evaluator", evaluator),
            *("--particles", "25", "--iterations", "25", "--preference", "A", "--seed", "1"),
        ]
        environment = {**os.environ, "XDG_CACHE_HOME": f"{folder}/cache"}
        start = time.perf_counter()
        with (
            Path(folder, "out").open("w") as out,
            subprocess.Popen(
                command, env=environment, stdout=out, stderr=subprocess.DEVNULL
            ) as process,
        ):
            main, worker = 0.0, 0.0
            while process.poll() is None:
                main = max(main, pss(process.pid))
                worker = max([worker, *(pss(pid) for pid in workers(process.pid))])
                time.sleep(0.5)
            seconds = time.perf_counter() - start
        result = json.loads(Path(folder, "out").read_text(encoding="utf-8"))
        return {
            "evaluator": evaluator,
            "seconds": seconds,
            "main_mib": main,
            "worker_mib": worker,
            "fitness": result["best"]["fitness"],
        }


def workers(root: int) -> list[int]:
    """Ray's worker processes below a process, by the title that they give themselves."""
    parents = {}
    for entry in Path("/proc").iterdir():
        if entry.name.isdigit():
            try:
                status = (entry / "stat").read_text(encoding="utf-8")
            except OSError:
                continue
            parents[int(entry.name)] = int(status.rpartition(")")[2].split()[1])
    found = []
    for pid in parents:
        above = pid
        while above in parents and above != root:
            above = parents[above]
        if above == root and title(pid).startswith("ray::"):
            found.append(pid)
    return found


def title(pid: int) -> str:
    """Command line of a process, "" if it has ended."""
    try:
        return Path(f"/proc/{pid}/cmdline").read_text(encoding="utf-8", errors="replace")
    except OSError:
        return ""


def pss(pid: int) -> float:
    """Proportional set size [MiB], 0 if the process has ended."""
    try:
        text = Path(f"/proc/{pid}/smaps_rollup").read_text(encoding="utf-8")
    except OSError:
        return 0.0
    (line,) = [line for line in text.splitlines() if line.startswith("Pss:")]
    return int(line.split()[1]) / 1024


def main() -> None:
    """Print a table, or JSON."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=1)
    parser.add_argument("--evaluators", nargs="+", default=["ray", "in-process"])
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args()
    rows = [run(evaluator) for _ in range(options.rounds) for evaluator in options.evaluators]
    if options.json:
        print(json.dumps(rows, indent=2))
        return
    print(f"{'evaluator':12} {'seconds':>8} {'main MiB':>9} {'worker MiB':>11} {'fitness':>20}")
    for row in rows:
        print(
            f"{row['evaluator']:12} {row['seconds']:8.1f} {row['main_mib']:9.0f}"
            f" {row['worker_mib']:11.0f} {row['fitness']!r:>20}"
        )


if __name__ == "__main__":
    main()
