"""Search methods by name, their presets, and the creation of a search."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import partial
from operator import attrgetter
from typing import TYPE_CHECKING, Annotated, Any, Final, Literal, TypeAlias, Union

from pydantic import BaseModel, Discriminator, Tag

from gaitswarm.services.optimizer.search.bayesian import BayesianSettings, bayesian
from gaitswarm.services.optimizer.search.cma_es import CmaEs, CmaEsSettings
from gaitswarm.services.optimizer.search.differential_evolution import (
    DeSettings,
    DifferentialEvolution,
)
from gaitswarm.services.optimizer.search.hype import Hype, HypeSettings
from gaitswarm.services.optimizer.search.optimizer import (
    Optimizer,
    Proposals,
    Replayed,
    SearchSettings,
)
from gaitswarm.services.optimizer.search.pso import ParticleSwarm, PsoSettings
from gaitswarm.services.optimizer.search.random_stream import RandomNumbers
from gaitswarm.services.optimizer.search.space import Space
from gaitswarm.sim import plugins
from gaitswarm.sim.arrays import Floats

Create = Callable[[Any, Space, int, int], Optimizer]
"""(settings, space, budget [evaluations], seed) -> an optimizer before its first ask."""


@dataclass(frozen=True, slots=True)
class Method:
    """A search method."""

    settings: type[SearchSettings]
    summary: str
    """One line for lists of methods, with the source."""
    create: Create
    multi_objective: bool = False
    """Whether it receives objective vectors instead of fitness values."""
    replays: bool = False
    """Whether its state is the complete feedback, which bounds the length of a job."""
    uses_start: bool = False
    """Whether it learns from the designs that a job starts from. Otherwise these designs are
    evaluated first and the method begins as if there were none.
    """
    libraries: tuple[str, ...] = ()
    """Distributions that its results depend on, besides those that every job depends on. Their
    versions are recorded, and a job resumes with the same versions only.
    """

    def versions(self) -> dict[str, str]:
        """Return the installed versions of its libraries, "none" for a missing one."""
        return {name: plugins.version_of(name) for name in self.libraries}

    @property
    def missing(self) -> tuple[str, ...]:
        """Libraries that are not installed."""
        return tuple(
            name for name, version in self.versions().items() if version == plugins.MISSING
        )

    @property
    def remedy(self) -> str:
        """Command that installs what is missing."""
        return f"pip install {' '.join(self.missing)}"


def from_generator(
    settings: type[SearchSettings],
    summary: str,
    search: Callable[..., Proposals],
    *,
    libraries: tuple[str, ...] = (),
) -> Method:
    """Make a method of a generator function that yields positions and receives their fitness.

    The state of such a method is the feedback it received, which is replayed when a job resumes.

    Args:
        settings: Model of its settings.
        summary: One line for lists of methods, with the source.
        search: Function of (settings, space, budget, random) that returns the generator. A
            parameter `start`, None by default, receives a `Start`: evaluated designs to begin from.
        libraries: As in `Method`.
    """
    return Method(
        settings,
        summary,
        partial(Replayed, search),
        replays=True,
        uses_start="start" in inspect.signature(search).parameters,
        libraries=libraries,
    )


LONGEST_REPLAY: Final = 250_000
"""Largest budget [evaluations] of a job whose search is replayed when it resumes."""


class AutoSettings(SearchSettings):
    """Settings that are replaced by those of a method when the job is submitted."""

    name: Literal["auto"] = "auto"


_LARGEST_DIMENSION: Final = 64
"""Variables up to which CMA-ES is chosen; its decomposition costs the cube of the dimension."""

_FEW_EVALUATIONS: Final = 250
"""Budget up to which Bayesian optimization is chosen, whose first designs come one by one."""


def chosen_method(
    settings: AutoSettings, space: Space, budget: int, *, starts: bool
) -> SearchSettings:
    """Choose the method by variables, evaluations and whether a search has a start."""
    if space.dimension > _LARGEST_DIMENSION:
        return DeSettings(particles=settings.particles)
    if budget <= _FEW_EVALUATIONS and not starts:
        return BayesianSettings(particles=settings.particles)
    if space.mostly_integer:
        return CmaEsSettings(particles=settings.particles, sigma=0.1, integers="centred")
    return CmaEsSettings(particles=settings.particles)


def _create_chosen(settings: AutoSettings, space: Space, budget: int, seed: int) -> Optimizer:
    return create_search(chosen_method(settings, space, budget, starts=False), space, budget, seed)


class RandomSearchSettings(SearchSettings):
    """Settings of random search."""

    name: Literal["random"] = "random"


def random_search(
    settings: RandomSearchSettings,
    space: Space,
    budget: int,  # noqa: ARG001 - the same for every budget
    random: RandomNumbers,
) -> Proposals:
    """Sample designs uniformly in the box, all integers and choices with equal probability."""
    while True:
        yield space.evenly(random.uniform(settings.particles, space.dimension))


_BUILT_IN: Final[dict[str, Method]] = {
    "auto": Method(
        AutoSettings,
        "Bayesian for up to 250 evaluations without a start, else CMA-ES, its settings by the share"
        " of integers, or differential evolution for more than 64 variables; chosen on submission",
        _create_chosen,
        uses_start=True,
    ),
    "bayesian": from_generator(
        BayesianSettings,
        "Gaussian process in a trust region (TuRBO, Eriksson et al. 2019), then CMA-ES",
        bayesian,
        libraries=("scipy",),
    ),
    "cma-es": Method(
        CmaEsSettings,
        "CMA-ES with diagonal acceleration, margin and restarts (Akimoto and Hansen 2020)",
        CmaEs,
        uses_start=True,
        libraries=("scipy",),
    ),
    "de": Method(
        DeSettings,
        "Differential evolution, L-SHADE (Tanabe and Fukunaga 2014)",
        DifferentialEvolution,
        uses_start=True,
        libraries=("scipy",),
    ),
    "hype": Method(
        HypeSettings,
        "Multi-objective: Pareto front by hypervolume, HypE (Bader and Zitzler 2011)",
        Hype,
        multi_objective=True,
        uses_start=True,
    ),
    "pso": Method(
        PsoSettings,
        "Particle swarm optimization (Kennedy and Eberhart 1995; thesis 3.4.1)",
        ParticleSwarm,
        uses_start=True,
    ),
    "random": from_generator(
        RandomSearchSettings,
        "Uniform random designs: the baseline for other methods",
        random_search,
    ),
}

_IN_RESEARCH: Final = (
    *("dts", "ga", "global-bfgs", "global-nelder-mead", "global-unirandi", "gsa", "mads"),
    *("nelder-mead", "ps", "pso-ps", "sa", "tlbo"),
)
"""Methods of the package gaitswarm-research, in the folder research/."""


def _accepted(plugin: plugins.Plugin, brought: object) -> Method:
    method = plugins.check_is(plugin, brought, Method)
    plugins.check_name(plugin, method.settings.model_fields["name"].default)
    # A job resumes only with the same version of the distribution that brings its method.
    return replace(method, libraries=(plugin.distribution, *method.libraries))


METHODS: Final = plugins.Registry[Method](
    "optimizer",
    _BUILT_IN,
    _accepted,
    elsewhere=dict.fromkeys(
        _IN_RESEARCH, "it is in the package gaitswarm-research: pip install ./research"
    ),
)
"""Methods by name, those of plug-ins included."""


def _tag(settings: Any) -> str | None:
    if isinstance(settings, BaseModel):
        return f"<{getattr(settings, 'name', '')}>"
    return f"<{settings.get('name')}>" if isinstance(settings, Mapping) else None


if TYPE_CHECKING:
    OptimizerSettings: TypeAlias = SearchSettings
else:
    # Tags in angle brackets are omitted from the locations that errors name.
    OptimizerSettings = Annotated[
        Union[tuple(Annotated[m.settings, Tag(f"<{name}>")] for name, m in _BUILT_IN.items())],  # noqa: UP007 - of a tuple
        Discriminator(
            _tag,
            custom_error_type="no_choice",
            custom_error_message="must be a name or an object with settings",
        ),
        plugins.PluginSettings(METHODS, attrgetter("settings"), "/v1/optimizers"),
    ]
    """Settings of any method, distinguished by their `name`."""

DEFAULT_METHOD: Final = "cma-es"
"""The best of the compared methods on the robot (research/docs/comparison.md)."""

_PRESETS: Final[dict[str, SearchSettings]] = {
    "pso-constriction": PsoSettings(
        inertia_start=0.7298,
        inertia_end=0.7298,
        cognitive=1.49618,
        social=1.49618,
        topology="ring",
    ),
    "pso-falling-inertia": PsoSettings(inertia_end=0.7),
}


class NamedSettings(Mapping[str, SearchSettings]):
    """Default settings of every method, and presets of `pso`, by name.

    `pso` is the thesis's swarm, whose inertia is constant. `pso-constriction` has the coefficients
    of Clerc and Kennedy (2002) in the ring of Bratton and Kennedy (2007).
    """

    def __getitem__(self, name: str) -> SearchSettings:
        return _PRESETS[name] if name in _PRESETS else METHODS[name].settings()  # type: ignore[call-arg]

    def __iter__(self) -> Iterator[str]:
        yield from self.built_in
        yield from (name for name in METHODS if name not in METHODS.built_in)

    def __len__(self) -> int:
        return len(METHODS) + len(_PRESETS)

    @property
    def built_in(self) -> tuple[str, ...]:
        """Names of gaitswarm's own methods and presets."""
        return tuple(sorted({*METHODS.built_in, *_PRESETS}))

    def unknown(self, name: str) -> str:
        """Explain that a name is unknown."""
        return f"unknown optimizer {name!r}; {METHODS.instead_of(name, self)}"


OPTIMIZERS: Final = NamedSettings()

OptimizerName: TypeAlias = Annotated[str, plugins.KnownName(OPTIMIZERS)]


def create_search(
    settings: OptimizerSettings | Mapping[str, Any] | str,
    space: Space,
    budget: int,
    seed: int,
    start: Floats | None = None,
) -> Optimizer:
    """Create a search of any installed method, outside of a job.

    Args:
        settings: Settings of a method, as a model or as a mapping with its `name`; or the name of a
            method or preset.
        space: The box to search.
        budget: Planned evaluations; methods may adapt to it.
        seed: Of all random numbers.
        start: (k, d) positions to begin with, or None.

    Returns:
        The search before its first ask.

    Raises:
        ValueError: The name is unknown (says which exist, or what to install) or a setting is not
            valid.
    """
    if not isinstance(settings, SearchSettings):
        name = settings if isinstance(settings, str) else str(settings.get("name"))
        if name not in OPTIMIZERS:
            raise ValueError(OPTIMIZERS.unknown(name))
        chosen = OPTIMIZERS[name]
        settings = chosen if isinstance(settings, str) else type(chosen).model_validate(settings)
    starts = start is not None and len(start) > 0
    if isinstance(settings, AutoSettings):
        settings = chosen_method(settings, space, budget, starts=starts)
    optimizer = METHODS[settings.name].create(settings, space, budget, seed)
    if start is not None and starts:
        optimizer.start_from(start)
    return optimizer
