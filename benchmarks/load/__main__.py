"""Latency of the API before a large store, and what a running job loses by it.

    python -m benchmarks.load [--databases sqlite postgresql] [--store jobs.db] [--quick]
        [--pairs 8] [--seconds 20] [--slots 2] [--apart] [--evaluator ray] [--rate 100]
        [--streams 200] [--json]

A store of a million evaluations is filled, served by `gaitswarm serve` on SQLite, and then on a
PostgreSQL server. A job runs, alone and under load in turns: requests are due at a fixed rate,
whether others have been answered or not, and a latency counts from then. Half of the event streams
follow the job. The client runs on the same machine; the processors that it takes are told.
"""

from __future__ import annotations

import argparse
import json
import os
import statistics
import sys
import tempfile
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Any, get_args

from sqlalchemy import create_engine

from benchmarks.load.filled import fill_with
from benchmarks.load.trial import Found, Load, run
from gaitswarm.services.optimizer.store.connections.engine import parse_url
from gaitswarm.services.optimizer.store.schema.backup import backup, restore
from gaitswarm.services.runtime import open_store
from gaitswarm.services.worker import EvaluatorKind
from tests.store.postgres_server import postgres_server, server_binaries


def quantile(values: list[float], share: float) -> float:
    """The least value that so many are not greater than."""
    ordered = sorted(values)
    return ordered[min(len(ordered) - 1, int(share * len(ordered)))]


def summary(found: Found) -> dict[str, Any]:
    """Latencies by kind of request, the job's loss, and who took the processors."""
    kinds = {}
    for kind in dict.fromkeys(answer.kind for answer in found.answers):
        milliseconds = [1e3 * a.seconds for a in found.answers if a.kind == kind]
        kinds[kind] = {
            "requests": len(milliseconds),
            "p50_ms": quantile(milliseconds, 0.5),
            "p99_ms": quantile(milliseconds, 0.99),
            "max_ms": max(milliseconds),
            "kilobytes": statistics.mean(a.length for a in found.answers if a.kind == kind) / 1e3,
        }
    ratios = [b / a for a, b in zip(found.alone, found.under_load, strict=True)]
    return {
        "latency": kinds,
        "not_200": sum(answer.status != 200 for answer in found.answers),
        "evaluations_per_second": {
            "alone": statistics.median(found.alone) if ratios else None,
            "under_load": statistics.median(found.under_load) if ratios else None,
            "ratios": ratios,
            "loss": 1.0 - statistics.median(ratios) if ratios else None,
        },
        "processors": {
            "client": statistics.median(found.client),
            "server_alone": statistics.median(alone for alone, _ in found.server),
            "server_under_load": statistics.median(loaded for _, loaded in found.server),
        },
        "events": found.events,
        "streams_ended": found.ended,
    }


def table(database: str, found: dict[str, Any]) -> str:
    """What came of a database, in Markdown."""
    lines = [
        f"| {database}: request | answers | p50 [ms] | p99 [ms] | longest [ms] | kB |",
        "| --- | --- | --- | --- | --- | --- |",
    ]
    for kind, row in found["latency"].items():
        lines.append(
            f"| {kind} | {row['requests']} | {row['p50_ms']:.1f} | {row['p99_ms']:.1f}"
            f" | {row['max_ms']:.0f} | {row['kilobytes']:.1f} |"
        )
    rates, processors, load = found["evaluations_per_second"], found["processors"], found["load"]
    lines.append("")
    if rates["loss"] is not None:
        ratios = " ".join(f"{ratio:.3f}" for ratio in rates["ratios"])
        lines.append(
            f"job: {rates['alone']:.1f} evaluations/s alone, {rates['under_load']:.1f} under load;"
            f" loss {rates['loss']:.1%}, by pairs {ratios}"
        )
    lines.append(
        f"processors: client {processors['client']:.2f}, server's process"
        f" {processors['server_alone']:.2f} alone, {processors['server_under_load']:.2f} under load"
    )
    lines.append(
        f"{found['events']} events came, {found['streams_ended']} streams ended,"
        f" {found['not_200']} answers were not 200"
    )
    lines.append(f"load average {load[0]:.2f} before, {load[1]:.2f} after\n")
    return "\n".join(lines)


@contextmanager
def served_from(database: str, filled: Path, folder: Path) -> Iterator[str]:
    """File or URL of a copy of a store, in either kind of database."""
    if database == "sqlite":
        copy = folder / "jobs.db"
        backup(str(filled), copy, overwrite=True)
        yield str(copy)
        return
    with postgres_server(server_binaries(), durable=True) as server:
        url = f"{server.url}/postgres"
        restore(url, filled)
        _settle(url)
        yield url


def _settle(url: str) -> None:
    """Do now what a server does in the minutes after so many rows came at once."""
    engine = create_engine(parse_url(url), isolation_level="AUTOCOMMIT")
    with engine.connect() as connection:
        connection.exec_driver_sql("VACUUM (ANALYZE)")
        connection.exec_driver_sql("CHECKPOINT")
    engine.dispose()


def main() -> None:
    """Print tables, or JSON."""
    parser = argparse.ArgumentParser(description=__doc__)
    usual = Load()
    parser.add_argument("--databases", nargs="+", default=["sqlite", "postgresql"])
    parser.add_argument("--store", type=Path, help="filled if it is not there, and kept")
    parser.add_argument("--evaluations", type=int, default=1_000_000)
    parser.add_argument("--jobs", type=int, default=1000, help="short ones")
    parser.add_argument("--pairs", type=int, default=usual.pairs)
    parser.add_argument("--seconds", type=float, default=usual.seconds, help="of a window")
    parser.add_argument("--rate", type=float, default=usual.per_second, help="requests a second")
    parser.add_argument("--streams", type=int, default=usual.streams)
    parser.add_argument("--slots", type=int, default=usual.slots, help="of the job; 0: no job")
    parser.add_argument("--apart", action="store_true", help="the job runs in another process")
    parser.add_argument(
        "--evaluator", choices=get_args(EvaluatorKind), default=usual.evaluator, help="of the job"
    )
    parser.add_argument("--quick", action="store_true", help="a small store, two short windows")
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args()
    if options.quick:
        options.evaluations, options.jobs, options.pairs, options.seconds = 20_000, 60, 1, 4.0
    load = Load(
        per_second=options.rate,
        streams=options.streams,
        seconds=options.seconds,
        pairs=options.pairs,
        slots=options.slots,
        apart=options.apart,
        evaluator=options.evaluator,
    )

    def say(line: str) -> None:
        print(line, file=sys.stderr, flush=True)

    found: dict[str, Any] = {}
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        filled = options.store or folder / "filled.db"
        if not filled.exists():
            with closing(open_store(str(filled))) as store:
                fill_with(store, options.evaluations, jobs=options.jobs, say=say)
        for database in options.databases:
            with served_from(database, filled, folder) as url:
                before = os.getloadavg()[0]
                say(f"{database} has the store")
                found[database] = summary(run(url, load, say))
                found[database]["load"] = [before, os.getloadavg()[0]]
    if options.json:
        print(json.dumps(found, indent=2))
        return
    for database, numbers in found.items():
        print(table(database, numbers))


if __name__ == "__main__":
    main()
