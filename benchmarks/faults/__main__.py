"""A campaign of random faults against a real deployment on this machine.

    python -m benchmarks.faults --faults 300 --seed 1 [--database postgresql] [--evaluator ray]
        [--kinds kill-api,kill-gcs=5] [--away 600] [--minutes 30] [--report FILE.md] [--json]

It reports three numbers that should be zero: iterations that were lost, histories that differ from
those of the same jobs alone, and steps that a person would have had to take. Exit code 1 if one is
not. As root, the database has a small disk and a network of its own; without, kinds that need these
are left out, and named. SIGTERM or Ctrl-C ends the faults, and what was found is reported; a second
one ends the campaign.
"""

from __future__ import annotations

import argparse
import json
import math
import shutil
import signal
import statistics
import subprocess
import sys
import threading
import time
from dataclasses import asdict
from datetime import UTC, datetime
from pathlib import Path

import gaitswarm
from benchmarks.faults.campaign import Result, run
from benchmarks.faults.deployment import ROOT, Deployment
from benchmarks.faults.kinds import KINDS, ClusterAway
from benchmarks.faults.plan import plan


def table(result: Result) -> str:
    """What came of a campaign, in Markdown."""
    lines = [
        f"{datetime.now(UTC):%Y-%m-%d}, {_version()}, load average {_range(result.loads)}.",
        "",
        "| fault | times | lasts [s] | next commit after [s], median | longest |",
        "| --- | --- | --- | --- | --- |",
    ]
    for name in sorted({kind for kind, _, _ in result.faults}):
        lasted = [seconds for kind, seconds, _ in result.faults if kind == name]
        after = [seconds for kind, _, seconds in result.faults if kind == name]
        lines.append(
            f"| `{name}` | {len(after)} | {_range(lasted)}"
            f" | {statistics.median(after):.1f} | {max(after):.1f} |"
        )
    restarts = ", ".join(f"{name} {count}" for name, count in result.restarts.items())
    lines += [
        "",
        f"{len(result.faults)} faults in {result.seconds:.0f} s. {result.jobs} jobs succeeded.",
        f"They have {result.iterations} iterations. Processes started again: {restarts}.",
        "",
        f"- iterations lost: {result.lost}",
        f"- histories that differ: {len(result.different)}",
        f"- manual steps: {len(result.manual)}",
        *(f"  - {step}" for step in result.manual),
    ]
    return "\n".join(lines) + "\n"


def _range(numbers: list[float]) -> str:
    return f"{min(numbers):.1f} to {max(numbers):.1f}" if numbers else "not known"


def _version() -> str:
    described = subprocess.run(
        ["git", "describe", "--always", "--dirty"],  # noqa: S607
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )
    return f"version {gaitswarm.__version__} {described.stdout.strip()}".rstrip()


def _kinds(text: str) -> dict[str, int | None]:
    named = (part.partition("=") for part in text.split(","))
    return {name: int(times) if equals else None for name, equals, times in named}


def main() -> int:
    """Run a campaign; 1 if anything was lost, differs or needed a person."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--faults", type=int, default=300)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--database", choices=["sqlite", "postgresql"], default="sqlite")
    parser.add_argument("--evaluator", choices=["in-process", "ray"], default="in-process")
    parser.add_argument(
        "--kinds",
        type=_kinds,
        help="names with commas between, NAME=TIMES for how often; default: all that are possible",
    )
    parser.add_argument("--away", type=float, default=20.0, help="how long the cluster is away [s]")
    parser.add_argument("--minutes", type=float, help="inject no more faults after so long")
    parser.add_argument("--iterations", type=int, default=60, help="of each job")
    parser.add_argument("--patience", type=float, default=180.0, help="without a commit [s]")
    parser.add_argument("--report", type=Path, help="file for the table")
    parser.add_argument("--logs", type=Path, help="folder for the processes' logs")
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args()
    ClusterAway.shortest = ClusterAway.longest = options.away
    with_ray = options.evaluator == "ray"
    asked_to_end = threading.Event()

    def end(number: int, _: object) -> None:
        if asked_to_end.is_set():
            sys.exit(128 + number)
        asked_to_end.set()

    for number in (signal.SIGTERM, signal.SIGINT):
        signal.signal(number, end)
    until = time.monotonic() + 60.0 * options.minutes if options.minutes else math.inf
    with Deployment(options.database, with_ray) as deployment:
        possible = [name for name, kind in KINDS.items() if kind.possible(deployment)]
        chosen = options.kinds or dict.fromkeys(possible)
        impossible = sorted(set(chosen) - set(possible))
        if impossible:
            parser.error(f"not possible here: {', '.join(impossible)}")
        left_out = sorted(set(KINDS) - set(chosen))
        print(f"left out: {', '.join(left_out) or 'none'}", file=sys.stderr)
        result = run(
            deployment,
            plan(options.seed, options.faults, chosen),
            iterations=options.iterations,
            patience=options.patience,
            enough=lambda: asked_to_end.is_set() or time.monotonic() > until,
            say=lambda line: print(line, file=sys.stderr, flush=True),
        )
        if options.logs:
            shutil.copytree(deployment.folder / "logs", options.logs, dirs_exist_ok=True)
    written = json.dumps(asdict(result), indent=2) if options.json else table(result)
    print(written)
    if options.report:
        options.report.write_text(table(result), encoding="utf-8")
    return int(bool(result.lost or result.different or result.manual))


if __name__ == "__main__":
    sys.exit(main())
