"""What a tournament runs: problems, methods with settings, and the jobs that they make."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final, Literal

from gaitswarm.cli.inputs.spec_file import parse_spec
from gaitswarm.services.optimizer.analysis.tournaments.entrants import NAME_PREFIX
from gaitswarm.services.optimizer.analysis.tournaments.standings import looked_at
from gaitswarm.services.optimizer.errors import InvalidRequest
from gaitswarm.services.optimizer.jobs.kinds.tournament import TournamentSpec
from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec
from gaitswarm.services.optimizer.search.method import missing_of
from gaitswarm.services.optimizer.search.registry import METHODS, OPTIMIZERS
from gaitswarm.services.optimizer.tournament.functions import FUNCTIONS
from gaitswarm.services.optimizer.tournament.methods import (
    is_multi_objective,
    libraries_of,
    method_names,
    named_settings,
    random_ranges,
    settings_models,
    why_unknown,
)
from gaitswarm.services.optimizer.tournament.race import default_checkpoints
from gaitswarm.services.optimizer.tournament.rivals import RIVALS
from gaitswarm.sim.input.near_names import instead_of

PresetName = Literal["thesis", "robot"]

Settings = Literal["random", "default"]


@dataclass(frozen=True, slots=True)
class Preset:
    """A tournament of a name.

    Attributes:
        problems: Names of its problems.
        methods: Names of its methods.
        repetitions: Runs of each method on each problem.
        evaluations: Budget of each run.
        settings: Whether settings are drawn anew for every run.
    """

    problems: tuple[str, ...]
    methods: tuple[str, ...]
    repetitions: int
    evaluations: int
    settings: Settings


@dataclass(frozen=True, slots=True)
class Size:
    """How much is run.

    Attributes:
        repetitions: Runs of each method on each problem.
        evaluations: Budget of each run.
        seed: Of the jobs, from which those of the runs are drawn.
        settings: Whether settings are drawn anew for every run.
    """

    repetitions: int
    evaluations: int
    seed: int
    settings: Settings

    @property
    def checkpoints(self) -> tuple[int, ...]:
        """Evaluations at which runs are looked at."""
        usual = default_checkpoints(self.evaluations)
        return tuple(sorted({*usual, *self.looked_at}))

    @property
    def looked_at(self) -> tuple[int, ...]:
        """Checkpoints whose medians are reported; the budget is the last."""
        return looked_at(self.evaluations)


_CHAPTER_3: Final = {"preference": "chapter-3", "scenarios": ["straight"]}

_ROBOT: Final[dict[str, dict[str, Any]]] = {
    **{f"chapter-4.{name}": {"controller": "fuzzy-pi", "preference": name} for name in "ABC"},
    "chapter-3.pi": {"controller": "pi", **_CHAPTER_3},
    "chapter-3.fuzzy-pi": {"controller": "fuzzy-pi-3", **_CHAPTER_3},
}
"""Jobs that tune the robot's drive."""

_BETWEEN: Final[dict[str, dict[str, Any]]] = {
    "chapter-3.fuzzy-pi-fixed-gait": _ROBOT["chapter-3.fuzzy-pi"],
    "chapter-4.A-straight": {**_ROBOT["chapter-4.A"], "scenarios": ["straight"]},
    "chapter-4.A-gait": _ROBOT["chapter-4.A"],
}
"""Jobs that differ from one of those in one thing only: for questions of what it matters for."""

_SEARCHING_GAIT: Final = {"chapter-3.pi", "chapter-3.fuzzy-pi", "chapter-4.A-gait"}
"""Jobs in which the gait is searched beside the controller."""

PROBLEMS: Final = (*FUNCTIONS, *_ROBOT, *_BETWEEN)
"""Names of all problems."""


def _of_jobs(names: Iterable[str]) -> tuple[str, ...]:
    """Methods that jobs may name and that can take part."""
    return tuple(name for name in names if not is_multi_objective(name))


PRESETS: Final[dict[PresetName, Preset]] = {
    "thesis": Preset(tuple(FUNCTIONS), _of_jobs(METHODS), 100, 2500, "random"),
    "robot": Preset(tuple(_ROBOT), (*_of_jobs(OPTIMIZERS), *RIVALS), 20, 625, "default"),
}


def chosen_problems(preset: Preset, names: str | None) -> list[str]:
    """Names of the problems."""
    chosen = list(preset.problems) if names is None else _names(names)
    _check(chosen, PROBLEMS, "problems")
    return chosen


def chosen_methods(
    preset: Preset, names: str | None, document: Mapping[str, Any] | None
) -> dict[str, Any]:
    """Methods by label, each as a spec names it."""
    if names is None:
        chosen = [] if document else [m for m in preset.methods if _is_installed(m)]
    else:
        chosen = _names(names)
    for name in filter(is_multi_objective, chosen):
        raise InvalidRequest(why_unknown(name, ()), field="methods")
    _check(chosen, method_names(), "methods")
    own = dict(document or {})
    for label in own:
        if label in chosen:
            raise InvalidRequest(f"{label!r} is named twice", field="methods")
    return {name: name for name in chosen} | own


def tournament_jobs(
    methods: Mapping[str, Any], problems: Sequence[str], size: Size, precision: str
) -> dict[str, TournamentSpec]:
    """The job of every method."""
    documents = [_problem(name, precision) for name in problems]
    found = {}
    for label, method in methods.items():
        document: dict[str, Any] = {
            "kind": "tournament",
            "name": f"{NAME_PREFIX}{label}",
            "method": method,
            "problems": documents,
            "evaluations": size.evaluations,
            "checkpoints": size.checkpoints,
            "stops_at_target": True,
            "iterations": size.repetitions,
            "seed": size.seed,
        }
        if size.settings == "random":
            document["variables"] = ["seed", *_drawn(method)]
        spec = parse_spec(document)
        if isinstance(spec, TournamentSpec):
            found[label] = spec
    return found


def _drawn(method: Any) -> list[dict[str, Any]]:
    """Ranges of the settings of a method that are not given."""
    if isinstance(method, str):
        given: Mapping[str, Any] = named_settings(method).model_dump(exclude_unset=True)
        name = named_settings(method).name
    else:
        given, name = method, method.get("name")
    if name not in settings_models():
        return []
    return [v.model_dump() for v in random_ranges(name) if v.name not in given]


def _is_installed(name: str) -> bool:
    return not missing_of(libraries_of(named_settings(name)))


def _problem(name: str, precision: str) -> dict[str, Any]:
    if name in FUNCTIONS:
        return {"function": name}
    job: dict[str, Any] = {**(_ROBOT | _BETWEEN)[name], "precision": precision}
    if name in _SEARCHING_GAIT:
        searching = JobSpec.model_validate(job).with_gait_searched()
        job = searching.model_dump(exclude={"optimizer", "iterations", "seed", "start"})
    return {"name": name, "job": job}


def _names(text: str) -> list[str]:
    return [name.strip() for name in text.split(",") if name.strip()]


def _check(chosen: Sequence[str], known: Sequence[str], field: str) -> None:
    if not chosen:
        raise InvalidRequest(f"one at least; known are {', '.join(known)}", field=field)
    for name in chosen:
        if name not in known:
            raise InvalidRequest(f"unknown {name!r}; {instead_of(name, known)}", field=field)
        if chosen.count(name) > 1:
            raise InvalidRequest(f"{name!r} is named twice", field=field)
