"""What follows from what in the evidence of one run, computed again without a walk."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Iterator, Mapping
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from gaitswarm.evidence.archive import parsed_json
from gaitswarm.evidence.certificates import SUMMARY, summary_differs
from gaitswarm.evidence.contents import BEST, CHAIN, best_of
from gaitswarm.evidence.history import chain_check
from gaitswarm.evidence.reading import Evidence, by_iteration
from gaitswarm.places import place_of
from gaitswarm.services.optimizer.analysis.search_path import retraced
from gaitswarm.services.optimizer.analysis.verification import BrokenChain, Chain, judged
from gaitswarm.services.optimizer.jobs.chain import VERSION as CHAIN_VERSION
from gaitswarm.services.optimizer.jobs.chain import ChainDocuments, Link, Outcomes
from gaitswarm.services.optimizer.jobs.columns import EvaluationColumns
from gaitswarm.services.optimizer.jobs.documents import SPECS, AnySpec
from gaitswarm.services.optimizer.jobs.fork import Lineage
from gaitswarm.services.optimizer.jobs.iteration import Reevaluation, best_particle
from gaitswarm.services.optimizer.jobs.kinds.certificate import CertificateSpec
from gaitswarm.services.optimizer.jobs.provenance import RECORDS, job_provenance
from gaitswarm.services.optimizer.search.registry import METHODS
from gaitswarm.sim.kernel.emitted.source import kernel_identity
from gaitswarm.sim.robot import load_robot
from gaitswarm.views import BestView

Floats = NDArray[np.float64]

_DIGITS: Final = 32

Answer = tuple[bool | None, str]
"""Whether a check passed, None where the job rules it out; and what was found."""


def checks_of(evidence: Evidence, members: Mapping[str, bytes]) -> dict[str, Callable[[], Answer]]:
    """List what can be checked of a run without a walk."""
    found: dict[str, Callable[[], Answer]] = {
        "robot": lambda: _robot(evidence, members),
        "fitness": lambda: _fitness(evidence),
        "best": lambda: _best(evidence, members),
        "designs": lambda: _designs(evidence),
        "search": lambda: _search(evidence),
        "chain": lambda: _chain(evidence),
    }
    if SUMMARY in members:
        found["summary"] = lambda: _summary(evidence, members)
    return found


def _tables(evidence: Evidence) -> Iterator[tuple[AnySpec, EvaluationColumns]]:
    yield evidence.spec, evidence.columns
    if evidence.reevaluated is not None:
        yield evidence.spec.in_double(), evidence.reevaluated


def _robot(evidence: Evidence, members: Mapping[str, bytes]) -> Answer:
    """The robots' files are those of which the provenance has the digest."""
    content = b""
    for number in range(len(evidence.spec.described)):
        folder = f"robots/{number}"
        for name in (f"{folder}/description.json", f"{folder}/robot.urdf"):
            if name not in members:
                return False, f"it has no {name}"
            content += members[name]
    expected = evidence.provenance.records[-1].provenance.simulation.robot_digest
    if hashlib.sha256(content).hexdigest()[:_DIGITS] != expected:
        return False, "the robot's files are not those that the provenance names"
    return True, f"its files have the digest {expected} of the provenance"


def _fitness(evidence: Evidence) -> Answer:
    """Fitness follows from raw objectives."""
    wrong, count = 0, 0
    for spec, columns in _tables(evidence):
        again = judged(spec, columns)
        wrong += int((again.view(np.uint64) != columns.fitness.view(np.uint64)).sum())
        count += len(columns)
    if wrong:
        return False, f"{wrong} of {count} do not follow from the raw objectives"
    return True, f"{count} of {count} follow from the raw objectives, to the bit"


def _best(evidence: Evidence, members: Mapping[str, bytes]) -> Answer:
    """The best is the earliest of least fitness, in double precision, and is shown as it is."""
    best, said = best_of(evidence.columns, evidence.reevaluated), evidence.job.best
    if best is None or said is None:
        return best is None and said is None, "no design has walked in every case"
    where = (best.iteration, best.particle)
    fitness = best.fitness if best.reevaluation is None else best.reevaluation.fitness
    if (said.iteration, said.particle, said.fitness) != (*where, fitness):
        return False, (
            f"design {place_of(*where)} is the best with {fitness!r}, not the one that is named"
        )
    shown = json.loads(BestView.from_evaluation(best, evidence.spec).model_dump_json())
    if parsed_json(members.get(BEST, b""), BEST) != shown:
        return False, f"{BEST} does not show design {place_of(*where)}"
    return True, f"design {place_of(*where)}, {fitness!r}, is the least of all"


def best_row(evidence: Evidence) -> tuple[int | None, EvaluationColumns]:
    """Find the best evaluation."""
    judged = evidence.columns if evidence.reevaluated is None else evidence.reevaluated
    return (best_particle(judged.fitness) if len(judged) else None), judged


def _designs(evidence: Evidence) -> Answer:
    """Designs are those that the asks stand for."""
    space = evidence.spec.design_space()
    designs = space.designs(np.concatenate(evidence.asked))
    wrong = int((designs != evidence.columns.designs).any(axis=1).sum())
    if wrong:
        return False, f"{wrong} of {len(designs)} are not what the search asked for"
    return True, f"{len(designs)} of {len(designs)} are what the search asked for"


def _search(evidence: Evidence) -> Answer:
    """The search, told the same, asks for the same."""
    spec, lineage = evidence.spec, evidence.job.lineage
    method = METHODS[spec.search.name]
    if method.missing:
        return None, f"{spec.search.name} needs {', '.join(method.missing)}, not installed here"
    columns = evidence.columns
    told = by_iteration(evidence, spec.told(columns.objectives, columns.failed, columns.fitness))
    try:
        retraced(spec, evidence.job.budgets, evidence.asked, told)
    except ValueError as error:
        if lineage is not None and lineage.carried == "search" and "preference" in lineage.changed:
            return None, "its memory was judged anew by another preference when it was forked"
        return False, f"{error}: other code, another seed, or numbers that it was never told"
    return True, f"{spec.search.name} asks for the same designs in {len(told)} iterations"


def _chain(evidence: Evidence) -> Answer:
    """The history is the one that its digests are of."""
    said = evidence.chain
    if said.version != CHAIN_VERSION:
        return None, f"it is of version {said.version}, which this gaitswarm does not compute"
    stored = (SPECS.validate_python(said.spec), said.lineage, said.provenance)
    if not _belongs(evidence, *stored):
        return False, f"{CHAIN} has another spec, lineage or provenance than the rest of the file"
    documents = ChainDocuments(said.spec, said.lineage, said.provenance)
    found = Chain(documents, evidence.spec)
    anew = _anew(evidence)
    links = zip(evidence.asked, said.asks, said.digests, strict=True)
    try:
        for index, (positions, ask, digest) in enumerate(links):
            columns = evidence.columns.of_iteration(index)
            link = Link(index, positions, ask, digest)
            found.extend(link, Outcomes.read(columns, anew.get(index)))
    except BrokenChain as error:
        return False, str(error)
    check = chain_check(found.iterations, found.head)
    return check.passed, check.detail


def _belongs(evidence: Evidence, spec: AnySpec, lineage: Any, provenance: Any) -> bool:
    """Whether documents, as they were stored, are those of the rest of the file."""
    own = evidence.job.lineage
    return (
        evidence.spec in (spec, spec.with_budget(evidence.spec.iterations))
        and (None if lineage is None else Lineage.model_validate(lineage)) == own
        and RECORDS.validate_python(provenance or ()) == evidence.provenance.records
    )


def _anew(evidence: Evidence) -> dict[int, Reevaluation]:
    """Reevaluations by iteration."""
    columns = evidence.reevaluated
    if columns is None:
        return {}
    return {
        int(columns.iteration[row]): Reevaluation(
            int(columns.particle[row]),
            columns.objectives[row],
            columns.statuses[row],
            float(columns.fitness[row]),
        )
        for row in range(len(columns))
    }


def _summary(evidence: Evidence, members: Mapping[str, bytes]) -> Answer:
    """What a certificate says follows from its walks."""
    spec = evidence.spec
    if not isinstance(spec, CertificateSpec):
        return False, f"a job of kind {spec.kind} has no {SUMMARY}"
    where = summary_differs(evidence.job.id, spec, evidence.columns, members[SUMMARY])
    if where is not None:
        return False, f"{SUMMARY} says another {where} than follows from the evaluations"
    return True, f"{SUMMARY} follows from {len(evidence.columns)} evaluations"


def changes_of_provenance(evidence: Evidence) -> Iterator[str]:
    """Say what numbers depend on that is different here, and what that means."""
    spec, here = evidence.spec, job_provenance(evidence.spec)
    found: list[str] = []
    for record in evidence.provenance.records:
        found += [
            f"from iteration {record.from_iteration} on: {change}"
            for change in record.provenance.changes(here)
        ]
    yield from found
    if not found:
        return
    kernels = tuple(kernel_identity(load_robot(r), spec.precision).hex() for r in spec.described)
    if kernels == evidence.provenance.kernels:
        yield (
            "the kernels have the source that they had when the file was written: physics and"
            " control loop are the same, and what differs lies around them"
        )
    else:
        yield "kernels have another source than when the file was written: walks may differ"
    yield "equal bits in the replay show that none of this matters for what was replayed"
