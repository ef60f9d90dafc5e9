"""Every search method by name: settings, presets, and how it is made."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from importlib import import_module, metadata
from typing import Any, Final, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from services.optimizer.search.evolution.cma_es import CmaEs, CmaEsSettings
from services.optimizer.search.evolution.differential_evolution import (
    DeSettings,
    DifferentialEvolution,
)
from services.optimizer.search.evolution.genetic import GaSettings
from services.optimizer.search.evolution.hype import Hype, HypeSettings
from services.optimizer.search.local.annealing import AnnealingSettings
from services.optimizer.search.local.directed_tabu import DirectedTabuSettings
from services.optimizer.search.local.mads import MadsSettings
from services.optimizer.search.local.nelder_mead import NelderMeadSettings
from services.optimizer.search.local.pattern_search import PatternSearchSettings
from services.optimizer.search.model.bayesian import BayesianSettings
from services.optimizer.search.multistart.global_search import (
    GlobalBfgsSettings,
    GlobalNelderMeadSettings,
    GlobalUnirandiSettings,
)
from services.optimizer.search.optimizer import Optimizer, SearchSettings
from services.optimizer.search.random_search import RandomSearchSettings
from services.optimizer.search.replayed import Replayed
from services.optimizer.search.space import Space
from services.optimizer.search.swarm.gsa import GsaSettings
from services.optimizer.search.swarm.pso import ParticleSwarm, PsoSettings
from services.optimizer.search.swarm.pso_ps import PsoPsSettings
from services.optimizer.search.swarm.tlbo import TlboSettings

Floats = NDArray[np.float64]

OptimizerSettings = (
    AnnealingSettings
    | BayesianSettings
    | CmaEsSettings
    | DeSettings
    | DirectedTabuSettings
    | GaSettings
    | GlobalBfgsSettings
    | GlobalNelderMeadSettings
    | GlobalUnirandiSettings
    | GsaSettings
    | HypeSettings
    | MadsSettings
    | NelderMeadSettings
    | PatternSearchSettings
    | PsoPsSettings
    | PsoSettings
    | RandomSearchSettings
    | TlboSettings
)
"""Settings of every method; their `name` tells them apart."""

MethodName = Literal[
    "bayesian",
    "cma-es",
    "de",
    "dts",
    "ga",
    "global-bfgs",
    "global-nelder-mead",
    "global-unirandi",
    "gsa",
    "hype",
    "mads",
    "nelder-mead",
    "ps",
    "pso",
    "pso-ps",
    "random",
    "sa",
    "tlbo",
]

OptimizerName = Literal[MethodName, "pso-constriction", "pso-thesis"]
"""What a job may name: a method with its default settings, or a preset."""

_MISSING: Final = "none"

Create = Callable[[Any, Space, int, int], Optimizer]
"""(settings, space, budget [evaluations], seed) -> the optimizer before its first ask."""


@dataclass(frozen=True, slots=True)
class Method:
    """A search method.

    Attributes:
        settings: Model of its settings.
        summary: What it is, with its source.
        create: Makes one.
        multi_objective: Whether it is told objective vectors in place of fitness.
        replays: Whether its state is all that it was told, so that a job of it is bounded.
        uses_start: Whether it learns from the designs that a job starts from. One that does not
            evaluates them first, and then goes on as if there had been none.
        extra: The optional dependencies that it needs, as in `gaitswarm[extra]`; "" if none.
        libraries: Distributions whose version its path may depend on, beside those that every job
            depends on; a job goes on with the same version only.
    """

    settings: type[OptimizerSettings]
    summary: str
    create: Create
    multi_objective: bool = False
    replays: bool = False
    uses_start: bool = False
    extra: str = ""
    libraries: tuple[str, ...] = ()

    def versions(self) -> dict[str, str]:
        """Versions of its libraries here; "none" for one that is not installed."""
        return versions_of(self.libraries)

    @property
    def missing(self) -> tuple[str, ...]:
        """Those of its libraries that are not installed here."""
        return missing_of(self.libraries)


def versions_of(libraries: Iterable[str]) -> dict[str, str]:
    """Versions of distributions here.

    Args:
        libraries: Their names.

    Returns:
        Version by name; "none" for one that is not installed.
    """
    return {name: _version(name) for name in libraries}


def missing_of(libraries: Iterable[str]) -> tuple[str, ...]:
    """Distributions that are not installed here.

    Args:
        libraries: Names of some.

    Returns:
        Those of them.
    """
    return tuple(name for name, version in versions_of(libraries).items() if version == _MISSING)


LONGEST_REPLAY: Final = 250_000
"""Most evaluations of a job whose search is replayed when it is resumed."""


def _generator(
    settings: type[OptimizerSettings],
    summary: str,
    place: str,
    *,
    uses_start: bool = False,
    extra: str = "",
    libraries: tuple[str, ...] = (),
) -> Method:
    """A method that is a generator function, which is replayed; `place` is module:function."""
    module, _, function = place.partition(":")

    def create(settings: SearchSettings, space: Space, budget: int, seed: int) -> Optimizer:
        search = getattr(import_module(f"services.optimizer.search.{module}"), function)
        return Replayed(search, settings, space, budget, seed)

    return Method(
        settings,
        summary,
        create,
        replays=True,
        uses_start=uses_start,
        extra=extra,
        libraries=libraries,
    )


METHODS: Final[dict[MethodName, Method]] = {
    "bayesian": _generator(
        BayesianSettings,
        "Gaussian process with batches, in a trust region (scikit-learn; TuRBO, Eriksson 2019)",
        "model.bayesian:bayesian",
        uses_start=True,
        extra="search",
        libraries=("scikit-learn", "scipy", "threadpoolctl"),
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
    "dts": _generator(
        DirectedTabuSettings,
        "Directed tabu search (Hedar and Fukushima 2006): explores, intensifies, diversifies",
        "local.directed_tabu:directed_tabu",
        uses_start=True,
    ),
    "ga": _generator(
        GaSettings,
        "Genetic algorithm for mixed variables (pymoo; Blank and Deb 2020)",
        "evolution.genetic:genetic_algorithm",
        extra="search",
        libraries=("pymoo",),
    ),
    "global-bfgs": _generator(
        GlobalBfgsSettings,
        "GLOBAL (Csendes et al. 2008): clustered samples, local searches by BFGS",
        "multistart.global_search:global_search",
        uses_start=True,
    ),
    "global-nelder-mead": _generator(
        GlobalNelderMeadSettings,
        "GLOBAL (Csendes et al. 2008): clustered samples, local searches by Nelder-Mead",
        "multistart.global_search:global_search",
        uses_start=True,
    ),
    "global-unirandi": _generator(
        GlobalUnirandiSettings,
        "GLOBAL (Csendes et al. 2008): clustered samples, local searches by UniRandi",
        "multistart.global_search:global_search",
        uses_start=True,
    ),
    "gsa": _generator(
        GsaSettings,
        "Gravitational search algorithm (Rashedi, Nezamabadi-pour and Saryazdi 2009)",
        "swarm.gsa:gsa",
    ),
    "hype": Method(
        HypeSettings,
        "Multi-objective: what trades best by hypervolume, HypE (Bader and Zitzler 2011)",
        Hype,
        multi_objective=True,
        uses_start=True,
    ),
    "mads": _generator(
        MadsSettings,
        "Mesh adaptive direct search (NOMAD 4; Audet, Le Digabel, Rochon Montplaisir et al. 2022)",
        "local.mads:mads",
        uses_start=True,
        extra="search",
        libraries=("PyNomadBBO",),
    ),
    "nelder-mead": _generator(
        NelderMeadSettings,
        "Simplex of Nelder and Mead (1965), adaptive coefficients (Gao and Han 2012), restarts",
        "local.nelder_mead:nelder_mead",
        uses_start=True,
    ),
    "ps": _generator(
        PatternSearchSettings,
        "Generalized pattern search on a mesh (Torczon 1997; Audet and Dennis 2003)",
        "local.pattern_search:pattern_search",
        uses_start=True,
    ),
    "pso": Method(
        PsoSettings,
        "Particle swarm optimization (Kennedy and Eberhart 1995; thesis 3.4.1)",
        ParticleSwarm,
        uses_start=True,
    ),
    "pso-ps": _generator(
        PsoPsSettings,
        "Particle swarm, then pattern search from its best designs (thesis 3.2.2)",
        "swarm.pso_ps:pso_ps",
        uses_start=True,
    ),
    "random": _generator(
        RandomSearchSettings,
        "Uniform random designs, each independent of all others: what a search has to beat",
        "random_search:random_search",
    ),
    "sa": _generator(
        AnnealingSettings,
        "Simulated annealing with adapted steps (Corana et al. 1987), cooling over the budget",
        "local.annealing:annealing",
        uses_start=True,
    ),
    "tlbo": _generator(
        TlboSettings,
        "Teaching-learning-based optimization (Rao, Savsani and Vakharia 2011)",
        "swarm.tlbo:tlbo",
        uses_start=True,
    ),
}

DEFAULT_METHOD: Final[MethodName] = "cma-es"
"""The best on the robot of all that were raced (docs/optimizers.md)."""

_PRESETS: Final[dict[str, OptimizerSettings]] = {
    "pso-constriction": PsoSettings(
        inertia_start=0.7298,
        inertia_end=0.7298,
        cognitive=1.49618,
        social=1.49618,
        topology="ring",
    ),
    "pso-thesis": PsoSettings(inertia_end=0.9),
}

OPTIMIZERS: Final[dict[str, OptimizerSettings]] = {
    name: _PRESETS[name] if name in _PRESETS else METHODS[name].settings()
    for name in sorted(get_args(OptimizerName))
}
"""Each method by its default settings, and presets of `pso`.

`pso` has an inertia that falls, `pso-thesis` one of 0.9 throughout. `pso-constriction` has the
coefficients of Clerc and Kennedy (2002) in the ring of Bratton and Kennedy (2007).
"""


def create_search(
    settings: OptimizerSettings,
    space: Space,
    budget: int,
    seed: int,
    start: Floats | None = None,
) -> Optimizer:
    """Create a search.

    Args:
        settings: Of its method.
        space: The box that is searched.
        budget: Evaluations of the planned run.
        seed: Of all random numbers.
        start: (k, d) positions to begin with, in the variables' own units; None for none.

    Returns:
        The optimizer before its first ask.

    Raises:
        ValueError: A start position is outside the bounds.
    """
    optimizer = METHODS[settings.name].create(settings, space, budget, seed)
    if start is not None and len(start):
        optimizer.start_from(start)
    return optimizer


def _version(distribution: str) -> str:
    try:
        return metadata.version(distribution)
    except metadata.PackageNotFoundError:
        return _MISSING
