"""Every search method by name: settings, presets, and how it is made."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import TYPE_CHECKING, Annotated, Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from gaitswarm.services.optimizer.search.evolution.cma_es import CmaEs, CmaEsSettings
from gaitswarm.services.optimizer.search.evolution.differential_evolution import (
    DeSettings,
    DifferentialEvolution,
)
from gaitswarm.services.optimizer.search.evolution.genetic import GaSettings
from gaitswarm.services.optimizer.search.evolution.hype import Hype, HypeSettings
from gaitswarm.services.optimizer.search.local.annealing import AnnealingSettings
from gaitswarm.services.optimizer.search.local.directed_tabu import DirectedTabuSettings
from gaitswarm.services.optimizer.search.local.mads import MadsSettings
from gaitswarm.services.optimizer.search.local.nelder_mead import NelderMeadSettings
from gaitswarm.services.optimizer.search.local.pattern_search import PatternSearchSettings
from gaitswarm.services.optimizer.search.method import Method, from_generator, settings_of
from gaitswarm.services.optimizer.search.model.bayesian import BayesianSettings
from gaitswarm.services.optimizer.search.multistart.global_search import (
    GlobalBfgsSettings,
    GlobalNelderMeadSettings,
    GlobalUnirandiSettings,
)
from gaitswarm.services.optimizer.search.optimizer import Optimizer, SearchSettings
from gaitswarm.services.optimizer.search.random_search import RandomSearchSettings
from gaitswarm.services.optimizer.search.space import Space
from gaitswarm.services.optimizer.search.swarm.gsa import GsaSettings
from gaitswarm.services.optimizer.search.swarm.pso import ParticleSwarm, PsoSettings
from gaitswarm.services.optimizer.search.swarm.pso_ps import PsoPsSettings
from gaitswarm.services.optimizer.search.swarm.tlbo import TlboSettings
from gaitswarm.sim.plugins import (
    KnownName,
    Plugin,
    PluginSettings,
    Registry,
    check_is,
    check_name,
)

Floats = NDArray[np.float64]

LONGEST_REPLAY: Final = 250_000
"""Most evaluations of a job whose search is replayed when it is resumed."""


_HERE: Final = "gaitswarm.services.optimizer.search"

_BUILT_IN: Final[dict[str, Method]] = {
    "bayesian": from_generator(
        BayesianSettings,
        "Gaussian process with batches, in a trust region (scikit-learn; TuRBO, Eriksson 2019)",
        f"{_HERE}.model.bayesian:bayesian",
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
    "dts": from_generator(
        DirectedTabuSettings,
        "Directed tabu search (Hedar and Fukushima 2006): explores, intensifies, diversifies",
        f"{_HERE}.local.directed_tabu:directed_tabu",
        uses_start=True,
    ),
    "ga": from_generator(
        GaSettings,
        "Genetic algorithm for mixed variables (pymoo; Blank and Deb 2020)",
        f"{_HERE}.evolution.genetic:genetic_algorithm",
        extra="search",
        libraries=("pymoo",),
    ),
    "global-bfgs": from_generator(
        GlobalBfgsSettings,
        "GLOBAL (Csendes et al. 2008): clustered samples, local searches by BFGS",
        f"{_HERE}.multistart.global_search:global_search",
        uses_start=True,
    ),
    "global-nelder-mead": from_generator(
        GlobalNelderMeadSettings,
        "GLOBAL (Csendes et al. 2008): clustered samples, local searches by Nelder-Mead",
        f"{_HERE}.multistart.global_search:global_search",
        uses_start=True,
    ),
    "global-unirandi": from_generator(
        GlobalUnirandiSettings,
        "GLOBAL (Csendes et al. 2008): clustered samples, local searches by UniRandi",
        f"{_HERE}.multistart.global_search:global_search",
        uses_start=True,
    ),
    "gsa": from_generator(
        GsaSettings,
        "Gravitational search algorithm (Rashedi, Nezamabadi-pour and Saryazdi 2009)",
        f"{_HERE}.swarm.gsa:gsa",
    ),
    "hype": Method(
        HypeSettings,
        "Multi-objective: what trades best by hypervolume, HypE (Bader and Zitzler 2011)",
        Hype,
        multi_objective=True,
        uses_start=True,
    ),
    "mads": from_generator(
        MadsSettings,
        "Mesh adaptive direct search (NOMAD 4; Audet, Le Digabel, Rochon Montplaisir et al. 2022)",
        f"{_HERE}.local.mads:mads",
        uses_start=True,
        extra="search",
        libraries=("PyNomadBBO",),
    ),
    "nelder-mead": from_generator(
        NelderMeadSettings,
        "Simplex of Nelder and Mead (1965), adaptive coefficients (Gao and Han 2012), restarts",
        f"{_HERE}.local.nelder_mead:nelder_mead",
        uses_start=True,
    ),
    "ps": from_generator(
        PatternSearchSettings,
        "Generalized pattern search on a mesh (Torczon 1997; Audet and Dennis 2003)",
        f"{_HERE}.local.pattern_search:pattern_search",
        uses_start=True,
    ),
    "pso": Method(
        PsoSettings,
        "Particle swarm optimization (Kennedy and Eberhart 1995; thesis 3.4.1)",
        ParticleSwarm,
        uses_start=True,
    ),
    "pso-ps": from_generator(
        PsoPsSettings,
        "Particle swarm, then pattern search from its best designs (thesis 3.2.2)",
        f"{_HERE}.swarm.pso_ps:pso_ps",
        uses_start=True,
    ),
    "random": from_generator(
        RandomSearchSettings,
        "Uniform random designs, each independent of all others: what a search has to beat",
        f"{_HERE}.random_search:random_search",
    ),
    "sa": from_generator(
        AnnealingSettings,
        "Simulated annealing with adapted steps (Corana et al. 1987), cooling over the budget",
        f"{_HERE}.local.annealing:annealing",
        uses_start=True,
    ),
    "tlbo": from_generator(
        TlboSettings,
        "Teaching-learning-based optimization (Rao, Savsani and Vakharia 2011)",
        f"{_HERE}.swarm.tlbo:tlbo",
        uses_start=True,
    ),
}


def _accepted(plugin: Plugin, brought: object) -> Method:
    method = check_is(plugin, brought, Method)
    check_name(plugin, method.settings.model_fields["name"].default)
    # A job goes on with the same version of what brought its method only.
    return replace(method, libraries=(plugin.distribution, *method.libraries))


METHODS: Final = Registry[Method]("optimizer", _BUILT_IN, _accepted)
"""By name, as in settings."""


MethodName: TypeAlias = Annotated[str, KnownName(METHODS)]

if TYPE_CHECKING:
    OptimizerSettings: TypeAlias = SearchSettings
else:
    OptimizerSettings = Annotated[
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
        | TlboSettings,
        PluginSettings(METHODS, settings_of, "/v1/optimizers"),
    ]
    """Settings of every method; their `name` tells them apart."""

DEFAULT_METHOD: Final = "cma-es"
"""The best on the robot of all that were raced (docs/optimizers.md)."""

_PRESETS: Final[dict[str, SearchSettings]] = {
    "pso-constriction": PsoSettings(
        inertia_start=0.7298,
        inertia_end=0.7298,
        cognitive=1.49618,
        social=1.49618,
        topology="ring",
    ),
    "pso-thesis": PsoSettings(inertia_end=0.9),
}


class NamedSettings(Mapping[str, SearchSettings]):
    """What a job may name in place of settings: methods of the registry, and presets."""

    def __init__(self, first: Mapping[str, SearchSettings] = MappingProxyType({})) -> None:
        self._first = first

    def __getitem__(self, name: str) -> SearchSettings:
        if name in self._first:
            return self._first[name]
        return _PRESETS[name] if name in _PRESETS else METHODS[name].settings()  # type: ignore[call-arg]

    def __iter__(self) -> Iterator[str]:
        yield from self.built_in
        yield from (name for name in METHODS if name not in METHODS.built_in)

    def __len__(self) -> int:
        return sum(1 for _ in self)

    @property
    def built_in(self) -> tuple[str, ...]:
        """Those of gaitswarm."""
        return (*self._first, *sorted({*METHODS.built_in, *_PRESETS}))

    def unknown(self, name: str) -> str:
        """Say that a name is none."""
        return f"unknown optimizer {name!r}; {METHODS.instead_of(name, self)}"


OPTIMIZERS: Final = NamedSettings()
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
    """Create a search."""
    optimizer = METHODS[settings.name].create(settings, space, budget, seed)
    if start is not None and len(start):
        optimizer.start_from(start)
    return optimizer
