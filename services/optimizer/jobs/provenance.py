"""Provenance of a job's results besides its spec"""

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

_JUDGING: Final = ("jobs/design_space.py", "jobs/preference.py", "jobs/spec.py")
"""Files that judge designs, for all kinds of jobs."""

_FOLDERS: Final = ("jobs/kinds", "search")
"""Folders in which every file judges designs or asks for them."""


class JobProvenance(BaseModel):
    """Code and libraries that a job's results depend on."""

    model_config = ConfigDict(frozen=True, extra="forbid", defer_build=True)

    gaitswarm: str = Field(
        description="Version of gaitswarm, for information; the digests identify the code.",
        examples=["0.1.0"],
    )
    optimizer_digest: str = Field(
        description="Digest of the source files that ask for designs and judge them.",
        examples=["3c6ef372fe94f82ba54ff53a5f1d36f1"],
    )
    search_libraries: dict[str, str] = Field(
        default_factory=dict,
        description="Versions of the libraries that the search method uses, if any.",
        examples=[{"cmaes": "0.13.1"}],
    )
    simulation: Provenance = Field(description="Provenance of the simulations.")

    def changes(self, now: JobProvenance) -> tuple[str, ...]:
        """Describe the differences from the present provenance."""
        changes = list(self.simulation.changes(now.simulation))
        if now.optimizer_digest != self.optimizer_digest:
            changes.append("other code of search and judgement")
        changes += version_changes(self.search_libraries, now.search_libraries)
        if changes and now.gaitswarm != self.gaitswarm:
            changes.append(f"gaitswarm {now.gaitswarm} instead of {self.gaitswarm}")
        return tuple(changes)


class ProvenanceRecord(BaseModel):
    """Provenance of a job's results from an iteration on."""

    model_config = ConfigDict(frozen=True, extra="forbid", defer_build=True)

    from_iteration: int = Field(
        ge=0, description="First iteration with this provenance, from 0.", examples=[0]
    )
    provenance: JobProvenance = Field(description="Provenance of this and later iterations.")


ProvenanceRecords = tuple[ProvenanceRecord, ...]
"""Of one job; append-only."""

RECORDS: Final = TypeAdapter(ProvenanceRecords)


def job_provenance(spec: Spec) -> JobProvenance:
    """Return the provenance of what this process computes for a job."""
    return JobProvenance(
        gaitswarm=installed_version(),
        optimizer_digest=optimizer_digest(),
        search_libraries=spec.search_libraries,
        simulation=provenance_of(
            *spec.robot_sources,
            precision=spec.precision,
            libraries=(*LIBRARIES, *spec.further_libraries),
        ),
    )


def changes_since(records: Sequence[ProvenanceRecord], now: JobProvenance) -> tuple[str, ...]:
    """Return the changes that require the user's consent before a job continues."""
    return records[-1].provenance.changes(now) if records else ()


def first_record(provenance: JobProvenance | None) -> ProvenanceRecords:
    return () if provenance is None else with_record((), 0, provenance)


def with_record(
    records: ProvenanceRecords, iterations: int, now: JobProvenance
) -> ProvenanceRecords:
    """Return the records of a job that continues."""
    if records and not records[-1].provenance.changes(now):
        return records
    return (*records, ProvenanceRecord(from_iteration=iterations, provenance=now))


def optimizer_files() -> tuple[Path, ...]:
    """Return the source files that ask for designs and judge them, in order."""
    files = (file for folder in _FOLDERS for file in sorted((_OPTIMIZER / folder).rglob("*.py")))
    return (*(_OPTIMIZER / name for name in _JUDGING), *files)


@lru_cache(maxsize=1)
def optimizer_digest() -> str:
    """Digest of `optimizer_files` at the first call; see `simulator_digest`."""
    return source_digest(_OPTIMIZER, optimizer_files())


@lru_cache(maxsize=1)
def installed_version() -> str:
    try:
        return metadata.version("gaitswarm")
    except metadata.PackageNotFoundError:
        return "0+unknown"
