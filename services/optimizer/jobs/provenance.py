"""What a job's numbers depend on beside its spec, since which iteration, and when it may go on."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from importlib import metadata
from pathlib import Path
from typing import Final

from pydantic import BaseModel, ConfigDict, Field, TypeAdapter

from gaitswarm.services.optimizer.jobs.spec import Spec
from gaitswarm.sim.plugins import source_digest
from gaitswarm.sim.provenance import LIBRARIES, Provenance, provenance_of, version_changes

_OPTIMIZER: Final = Path(__file__).parents[1]

_JUDGING: Final = (
    "jobs/design_space.py",
    "jobs/optimizer_choice.py",
    "jobs/preference.py",
    "jobs/spec.py",
    "jobs/start.py",
)
"""Files that judge designs of all kinds of jobs."""

_ROOMS: Final = ("jobs/kinds", "search")
"""Folders in which every file judges designs or asks for them."""


class JobProvenance(BaseModel):
    """What a job's numbers depend on beside its spec."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    gaitswarm: str = Field(
        description="Version of gaitswarm. For people: the digests tell whether code is the same.",
        examples=["0.1.0"],
    )
    optimizer_digest: str = Field(
        description="Digest of the source files that ask for designs and judge them.",
        examples=["3c6ef372fe94f82ba54ff53a5f1d36f1"],
    )
    search_libraries: dict[str, str] = Field(
        default_factory=dict,
        description="Versions of the libraries that its search method computes with, if any.",
        examples=[{"cmaes": "0.13.1"}],
    )
    simulation: Provenance = Field(description="What its walks depend on.")

    def changes(self, now: JobProvenance) -> tuple[str, ...]:
        """What is different now, in words for people."""
        found = list(self.simulation.changes(now.simulation))
        if now.optimizer_digest != self.optimizer_digest:
            found.append("other code of search and judgement")
        found += version_changes(self.search_libraries, now.search_libraries)
        if found and now.gaitswarm != self.gaitswarm:
            found.append(f"gaitswarm {now.gaitswarm} instead of {self.gaitswarm}")
        return tuple(found)


class ProvenanceRecord(BaseModel):
    """Since which iteration a job's numbers have had which provenance."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    from_iteration: int = Field(
        ge=0, description="First iteration that was computed so, from 0.", examples=[0]
    )
    provenance: JobProvenance = Field(description="What its numbers and those after it depend on.")


ProvenanceRecords = tuple[ProvenanceRecord, ...]
"""Of one job, only ever appended to."""

RECORDS: Final = TypeAdapter(ProvenanceRecords)


def job_provenance(spec: Spec) -> JobProvenance:
    """The provenance of what this process computes for a job."""
    return JobProvenance(
        gaitswarm=_version(),
        optimizer_digest=optimizer_digest(),
        search_libraries=spec.search_libraries,
        simulation=provenance_of(
            *spec.described,
            precision=spec.precision,
            libraries=(*LIBRARIES, *spec.further_libraries),
        ),
    )


def changes_since(records: Sequence[ProvenanceRecord], now: JobProvenance) -> tuple[str, ...]:
    """What keeps a job from going on without its user's consent."""
    return records[-1].provenance.changes(now) if records else ()


def first_record(provenance: JobProvenance | None) -> ProvenanceRecords:
    """Records of a job that is submitted."""
    return () if provenance is None else with_record((), 0, provenance)


def with_record(
    records: ProvenanceRecords, iterations: int, now: JobProvenance
) -> ProvenanceRecords:
    """Records of a job that goes on."""
    if records and not records[-1].provenance.changes(now):
        return records
    return (*records, ProvenanceRecord(from_iteration=iterations, provenance=now))


def optimizer_files() -> tuple[Path, ...]:
    """The source files that judge designs and ask for them, in order."""
    rooms = (file for room in _ROOMS for file in sorted((_OPTIMIZER / room).rglob("*.py")))
    return (*(_OPTIMIZER / name for name in _JUDGING), *rooms)


@lru_cache(maxsize=1)
def optimizer_digest() -> str:
    """Digest of `optimizer_files`, as they are when it is called first; see `simulator_digest`."""
    return source_digest(_OPTIMIZER, optimizer_files())


@lru_cache(maxsize=1)
def _version() -> str:
    """Of the installed package; a bare checkout has none."""
    try:
        return metadata.version("gaitswarm")
    except metadata.PackageNotFoundError:
        return "0+unknown"
