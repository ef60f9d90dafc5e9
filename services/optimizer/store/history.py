"""Committed iterations: writing, reading, and taking over in a fork

Floats keep every bit, except that objectives that are not finite are stored as NaN.
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from datetime import datetime
from itertools import pairwise
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from sqlalchemy import ColumnElement, Connection, Table, bindparam, insert, select, update

from gaitswarm.services.optimizer.errors import Conflict, NotFound
from gaitswarm.services.optimizer.jobs.chain import (
    ChainDocuments,
    Link,
    ask_digest,
    iteration_digest,
)
from gaitswarm.services.optimizer.jobs.fork import Lineage, TakenHistory
from gaitswarm.services.optimizer.jobs.iteration import (
    SUMMARY,
    Answered,
    Ask,
    CompletedIteration,
    Evaluation,
    EvaluationColumns,
    Iteration,
    JournalEntry,
    Reevaluation,
    evaluations_of,
    fitness_summary,
)
from gaitswarm.services.optimizer.jobs.listing import Page, checked_limit
from gaitswarm.services.optimizer.store import job_rows
from gaitswarm.services.optimizer.store.engine import Aggregate
from gaitswarm.services.optimizer.store.tables import (
    Row,
    evaluations,
    iterations,
    jobs,
    journal,
    reevaluations,
)
from gaitswarm.sim.outcome import Outcome, Status

_LARGEST_INDEX: Final = 2**31 - 1

_KEYS_AT_ONCE: Final = 1000
_ITERATIONS_AT_ONCE: Final = 64

_STATUSES: Final = frozenset(Status)


class History(Aggregate):
    """Committed iterations, which never change; a long history is read in several transactions."""

    def iterations(
        self, job_id: str, *, after: int | None = None, limit: int = 100
    ) -> Page[Iteration]:
        """Return a page of the committed iterations after an index, in order."""
        limit = checked_limit(limit)
        table = iterations.c
        names = ("designs", *SUMMARY, "evaluate_seconds", "committed_at", "digest")
        query = (
            select(table.iteration.label("index"), *(table[name] for name in names))
            .where(
                table.job_id == job_id,
                table.iteration > (-1 if after is None else _bounded(after)),
                table.committed_at.is_not(None),
            )
            .order_by(table.iteration)
            .limit(limit + 1)
        )
        with self._database.read("iterations") as connection:
            job_rows.require_job(connection, job_id)
            rows = connection.execute(query).mappings().all()
        return Page.of([Iteration(**row) for row in rows], limit, lambda last: str(last.index))

    def evaluations(self, job_id: str, iteration: int) -> tuple[Evaluation, ...]:
        """Return all designs of an iteration, by particle. Raises NotFound if not committed."""
        found = self.evaluations_between(job_id, iteration, iteration + 1)
        if not found:
            raise NotFound(f"job {job_id} has no committed iteration {iteration}")
        return found

    def evaluations_between(self, job_id: str, first: int, last: int) -> tuple[Evaluation, ...]:
        """Return all designs of a range of iterations, by iteration and particle."""
        columns = self.evaluation_columns(job_id, first, last)
        return () if columns is None else evaluations_of(columns)

    def evaluation_columns(self, job_id: str, first: int, last: int) -> EvaluationColumns | None:
        """Return the designs of `evaluations_between` as columns; None if there are none."""
        with self._database.read("evaluation_columns") as connection:
            job_rows.require_job(connection, job_id)
            return _select_columns(connection, job_id, first, last)

    def best(self, job_id: str) -> Evaluation | None:
        """Return the earliest design of least fitness in double precision, with reevaluation."""
        with self._database.read("best") as connection:
            job_rows.require_job(connection, job_id)
            place = select(jobs.c.best_iteration, jobs.c.best_particle).where(jobs.c.id == job_id)
            iteration, particle = connection.execute(place).one()
            if iteration is None:
                return None
            columns = _select_columns(connection, job_id, iteration, iteration + 1)
            again = _select_reevaluations(connection, job_id, iteration, iteration + 1)
        best = None if columns is None else evaluations_of(columns)[particle]
        return best and best._replace(reevaluation=again[0][1] if again else None)

    def closest(self, job_id: str) -> tuple[Evaluation, ...]:
        """Return the earliest iteration of least violation; empty if there is none."""
        of_job = iterations.c.job_id == job_id, iterations.c.least_violation.is_not(None)
        first = (iterations.c.least_violation, iterations.c.iteration)
        query = select(iterations.c.iteration).where(*of_job).order_by(*first).limit(1)
        with self._database.read("closest") as connection:
            iteration = connection.execute(query).scalar()
        return () if iteration is None else self.evaluations(job_id, iteration)

    def reevaluations(
        self, job_id: str, first: int = 0, last: int = _LARGEST_INDEX
    ) -> tuple[tuple[int, Reevaluation], ...]:
        """Return the reevaluations of a range of iterations, each after its iteration's index."""
        with self._database.read("reevaluations") as connection:
            job_rows.require_job(connection, job_id)
            return _select_reevaluations(connection, job_id, first, last)

    def known(self, keys: Sequence[bytes]) -> dict[bytes, Outcome]:
        """Return the outcomes of designs that any job has simulated; a row for each case."""
        table, outcomes = evaluations.c, dict[bytes, Outcome]()
        columns = (table.walk_key, table.objectives, table.statuses)
        with self._database.read("known") as connection:
            for first in range(0, len(keys), _KEYS_AT_ONCE):
                some = table.walk_key.in_(keys[first : first + _KEYS_AT_ONCE])
                for row in connection.execute(select(*columns).where(some)).mappings():
                    # A damaged outcome is simulated again.
                    with suppress(ValueError, TypeError):
                        if _STATUSES.issuperset(row["statuses"]):
                            outcomes[row["walk_key"]] = _outcome(row)
        return outcomes

    def chain_documents(self, job_id: str) -> ChainDocuments:
        """Return the documents other than iterations that a job's chain depends on, as stored."""
        with self._database.read("chain_documents") as connection:
            return job_rows.chain_documents(job_rows.job_row(connection, job_id))

    def links(self, job_id: str, first: int, last: int) -> tuple[Link, ...]:
        """Return a range of iterations, including the current one; ValueError for a damaged one."""
        with self._database.read("links") as connection:
            return _select_links(connection, job_id, first, last)


def _bounded(index: int) -> int:
    """Return an index that both databases can compare."""
    return max(-1, min(index, _LARGEST_INDEX))


def _between(table: Table, job_id: str, first: int, last: int) -> tuple[ColumnElement[bool], ...]:
    iteration = table.c.iteration
    return table.c.job_id == job_id, iteration >= _bounded(first), iteration < _bounded(last)


def _select_columns(
    connection: Connection, job_id: str, first: int, last: int
) -> EvaluationColumns | None:
    table = evaluations.c
    columns = (table.design, table.objectives, table.statuses, table.fitness)
    query = (
        select(table.iteration, table.particle, *columns)
        .where(*_between(evaluations, job_id, first, last))
        .order_by(table.iteration, table.particle)
    )
    # The driver's tuples: Row objects would take a third of the time to read a history.
    rows = connection.execute(query).cursor.fetchall()
    if not rows:
        return None
    iteration, particle, designs, objectives, statuses, fitness = zip(*rows, strict=True)
    labels = np.frombuffer(b"".join(statuses), dtype=np.uint8).reshape(len(rows), -1)
    return EvaluationColumns(
        iteration=np.array(iteration, dtype=np.int64),
        particle=np.array(particle, dtype=np.int64),
        designs=_floats(b"".join(designs), len(rows)),
        objectives=_floats(b"".join(objectives), *labels.shape),
        statuses=labels,
        fitness=np.array(fitness, dtype=np.float64),
    )


def _floats(content: bytes, *shape: int) -> NDArray[np.float64]:
    """Return an array of a shape and one more axis."""
    return np.frombuffer(content, dtype="<f8").astype(np.float64).reshape(*shape, -1)


def _outcome(row: Row) -> Outcome:
    """Return an outcome of a row of cases, or of designs in a case."""
    statuses = np.frombuffer(row["statuses"], dtype=np.uint8)
    return Outcome(_floats(row["objectives"], len(statuses)), statuses)


def _select_reevaluations(
    connection: Connection, job_id: str, first: int, last: int
) -> tuple[tuple[int, Reevaluation], ...]:
    query = select(reevaluations).where(*_between(reevaluations, job_id, first, last))
    query = query.order_by(reevaluations.c.iteration, reevaluations.c.particle)
    found = []
    for row in connection.execute(query).mappings():
        outcome = _outcome(row)
        again = Reevaluation(row["particle"], outcome.objectives, outcome.statuses, row["fitness"])
        found.append((row["iteration"], again))
    return tuple(found)


def _select_links(connection: Connection, job_id: str, first: int, last: int) -> tuple[Link, ...]:
    query = select(iterations).where(*_between(iterations, job_id, first, last))
    rows = connection.execute(query.order_by(iterations.c.iteration)).mappings()
    return tuple(
        Link(
            row["iteration"],
            _floats(row["positions"], row["designs"]),
            row["ask_digest"],
            row["digest"],
            row["committed_at"] is not None,
            row["optimizer_state"],
            {name: row[name] for name in SUMMARY},
        )
        for row in rows
    )


# Built once: that takes longer than to execute them.
_PLACE: Final = (iterations.c.job_id == bindparam("of")) & (
    iterations.c.iteration == bindparam("at")
)
_ASK: Final = select(iterations).where(_PLACE)
_OPEN: Final = select(iterations.c.designs, iterations.c.positions, iterations.c.ask_digest).where(
    _PLACE, iterations.c.committed_at.is_(None)
)
_UPDATE: Final = update(iterations).where(_PLACE)


def open_ask(connection: Connection, job: Row) -> Ask | None:
    """Return the ask that is not committed yet; None before the first or after the last."""
    return _ask(connection, job["id"], job["iterations"])


def answered_ask(connection: Connection, job: Row) -> Answered | None:
    """Return the last committed ask with its evaluations; None before the first commit."""
    last = job["iterations"] - 1
    ask = _ask(connection, job["id"], last)
    columns = None if ask is None else _select_columns(connection, job["id"], last, last + 1)
    return None if ask is None or columns is None else Answered(ask, columns)


def _ask(connection: Connection, job_id: str, iteration: int) -> Ask | None:
    row = connection.execute(_ASK, {"of": job_id, "at": iteration}).mappings().first()
    if row is None:
        return None
    positions = _floats(row["positions"], row["designs"])
    return Ask(row["iteration"], positions, row["optimizer_state"])


def insert_ask(connection: Connection, job: Row, ask: Ask, *, expected: int, now: datetime) -> None:
    """Store an ask before it is evaluated. Raises Conflict for another than the next iteration."""
    if ask.iteration != expected:
        raise Conflict(
            f"job {job['id']} asks for iteration {ask.iteration}, but its next is {expected}"
        )
    if not np.isfinite(ask.positions).all():
        raise ValueError(f"a position of iteration {ask.iteration} is not a finite number")
    digest = ask_digest(ask.positions, ask.state)
    connection.execute(insert(iterations), _ask_row(job, ask, digest, now))


def _ask_row(job: Row, ask: Ask, digest: str | None, now: datetime) -> dict[str, Any]:
    return {
        "job_id": job["id"],
        "iteration": ask.iteration,
        "designs": len(ask.positions),
        "positions": ask.positions.astype("<f8").tobytes(),
        "optimizer_state": ask.state,
        "ask_digest": digest,
        "asked_at": now,
    }


def complete_iteration(
    connection: Connection, job: Row, done: CompletedIteration, now: datetime
) -> dict[str, Any]:
    """Store the results of the open ask; return changed columns of the job. Raises Conflict.

    Clears the optimizer's state of the iteration before, as states may grow with every iteration.
    """
    place = {"of": job["id"], "at": done.iteration}
    row = connection.execute(_OPEN, place).first()
    if row is None:
        raise Conflict(
            f"iteration {done.iteration} of job {job['id']} was not asked; its next is"
            f" {job['iterations']}"
        )
    link = Link(done.iteration, _floats(row.positions, row.designs), row.ask_digest)
    connection.execute(_UPDATE, {**place, "at": done.iteration - 1, "optimizer_state": {}})
    changes, results = _results(job, job_rows.chain_documents(job), link, done, now)
    (committed,) = results.pop(iterations)
    connection.execute(_UPDATE, place | committed)
    for table, rows in results.items():
        connection.execute(insert(table), rows)
    return changes


def _results(
    job: Row, documents: ChainDocuments, link: Link, done: CompletedIteration, now: datetime
) -> tuple[dict[str, Any], dict[Table, list[dict[str, Any]]]]:
    """Return changed columns of the job, and rows by table: columns of the iteration, designs."""
    columns = done.columns
    before = job["head"] or documents.digest
    digest = iteration_digest(before, documents, link, columns, done.reevaluation)
    particle, best = done.best or (None, None)
    summary = fitness_summary(done.fitness, best, job["best_fitness"], done.violations)
    committed = {
        "committed_at": now,
        "evaluate_seconds": done.evaluate_seconds,
        "digest": digest,
        **summary,
    }
    place = {"job_id": job["id"], "iteration": done.iteration}
    keys = done.keys or [None] * len(columns)
    designs = columns.designs.astype("<f8")
    results = map(_result, columns.objectives, columns.statuses, columns.fitness.tolist())
    rows = [
        {**place, "particle": index, "design": design.tobytes(), "walk_key": key, **result}
        for index, (design, key, result) in enumerate(zip(designs, keys, results, strict=True))
    ]
    tables = {iterations: [committed], evaluations: rows}
    again = done.reevaluation
    if again is not None:
        result = _result(again.objectives, again.statuses, again.fitness)
        tables[reevaluations] = [{**place, "particle": again.particle, **result}]
    changes = {
        "head": digest,
        "iterations": done.iteration + 1,
        "evaluations": job["evaluations"] + len(columns),
        "infeasible": job["infeasible"] + summary["infeasible"],
    }
    least, least_before = summary["least_violation"], job["least_violation"]
    if least is not None and (least_before is None or least < least_before):
        changes["least_violation"] = least
    if best is not None and (job["best_fitness"] is None or best < job["best_fitness"]):
        changes |= {"best_fitness": best, "best_iteration": done.iteration}
        changes |= {"best_particle": particle}
    return changes, tables


def _result(
    objectives: NDArray[np.float64], statuses: NDArray[np.uint8], fitness: float
) -> dict[str, Any]:
    """Return the columns of a design's results."""
    return {
        "objectives": np.where(np.isfinite(objectives), objectives, np.nan).astype("<f8").tobytes(),
        "statuses": statuses.astype(np.uint8).tobytes(),
        "fitness": fitness if math.isfinite(fitness) else math.inf,
    }


def insert_entries(connection: Connection, job: Row, entries: Sequence[JournalEntry]) -> None:
    """Add outcomes of the open ask of a locked job."""
    rows = [
        {
            "job_id": job["id"],
            "iteration": job["iterations"],
            "case_index": entry.case,
            "keys": b"".join(entry.keys),
            "objectives": entry.outcome.objectives.astype("<f8").tobytes(),
            "statuses": entry.outcome.statuses.astype(np.uint8).tobytes(),
        }
        for entry in entries
    ]
    connection.execute(insert(journal), rows)


def journal_of(connection: Connection, job: Row) -> tuple[JournalEntry, ...]:
    """Return the entries of a job's open ask, in the order of their writing."""
    of_ask = (journal.c.job_id == job["id"]) & (journal.c.iteration == job["iterations"])
    query = select(journal).where(of_ask).order_by(journal.c.id)
    return tuple(_journal_entry(row) for row in connection.execute(query).mappings())


def _journal_entry(row: Row) -> JournalEntry:
    count = len(row["statuses"])
    size = len(row["keys"]) // count
    keys = tuple(row["keys"][k * size : (k + 1) * size] for k in range(count))
    return JournalEntry(row["case_index"], keys, _outcome(row))


def take_history(
    connection: Connection, job: Row, lineage: Lineage, taken: TakenHistory, now: datetime
) -> dict[str, Any]:
    """Commit the parent's iterations to a fork, which then no longer depends on the parent."""
    parent, end, spec = lineage.parent, lineage.from_iteration, job_rows.to_job(job).spec
    provenance = job_rows.provenance_document(taken.provenance)
    documents = ChainDocuments(
        job_rows.parsed(job["spec"]), job_rows.parsed(job["lineage"]), provenance
    )
    changes: dict[str, Any] = {
        "provenance": provenance,
        "accepts_changes": taken.accepts_changes,
    }
    for first, last in pairwise([*range(0, end, _ITERATIONS_AT_ONCE), end]):
        columns = _select_columns(connection, parent, first, last)
        reevaluated = dict(_select_reevaluations(connection, parent, first, last))
        links = _select_links(connection, parent, first, last)
        if columns is None or sum(link.committed for link in links) < last - first:
            raise Conflict(
                f"job {parent} has not the {end} iterations any more that were to be forked"
            )
        tables = defaultdict[Table, list[dict[str, Any]]](list)
        for link in links:
            index = link.iteration
            ask = Ask(index, link.positions, taken.state if index == end - 1 else {})
            if index == end - 1:
                link = replace(link, ask_digest=ask_digest(ask.positions, ask.state))  # noqa: PLW2901
            of_parent = columns.of_iteration(index)
            done = CompletedIteration(
                index,
                of_parent.designs,
                tuple(
                    Outcome(of_parent.objectives[:, case], of_parent.statuses[:, case])
                    for case in range(of_parent.statuses.shape[1])
                ),
                of_parent.fitness if taken.fitness is None else taken.fitness[index],
                evaluate_seconds=0.0,
                precision=spec.precision,
                reevaluation=reevaluated.get(index),
                violations=spec.violations(of_parent.objectives, of_parent.failed),
            )
            changed, results = _results({**job, **changes}, documents, link, done, now)
            changes |= changed
            results[iterations][0] |= _ask_row(job, ask, link.ask_digest, now)
            for table, rows in results.items():
                tables[table] += rows
        for table, rows in tables.items():
            connection.execute(insert(table), rows)
    return changes | {"evaluations_saved": changes["evaluations"]}
