"""Catalogues: robots, scenarios, preferences, optimizers, controllers, cases, plug-ins."""

from __future__ import annotations

from typing import Annotated, Any, Generic, Literal, TypeVar

from pydantic import ConfigDict, Field

from gaitswarm.services.optimizer.jobs.preference import PREFERENCES, Preference, PreferenceName
from gaitswarm.services.optimizer.search.registry import (
    METHODS,
    OPTIMIZERS,
    OptimizerName,
    OptimizerSettings,
)
from gaitswarm.services.optimizer.views import View, fields_of, listing_name
from gaitswarm.sim.case_registry import CASES
from gaitswarm.sim.catalogue import GAIT_VARIABLES, design_shown
from gaitswarm.sim.controllers import CONTROLLERS
from gaitswarm.sim.plugins import Kind, Registry
from gaitswarm.sim.robot import DEFAULT_ROBOT, SHIPPED, RobotName, load_robot
from gaitswarm.sim.robot.identifiable import CONVENTIONAL_VARIABLES, identifiable_variables
from gaitswarm.sim.scenario import PRESETS, Scenario
from gaitswarm.sim.variables import Variable

T = TypeVar("T")


class CatalogueView(View, Generic[T]):
    """A complete list."""

    # A parametrized generic does not inherit its docstring.
    model_config = ConfigDict(json_schema_extra={"description": "A complete list."})

    items: list[T] = Field(description="All entries, in the order of the thesis's tables.")

    @classmethod
    def model_parametrized_name(cls, params: tuple[Any, ...]) -> str:
        return listing_name(params, "List")


class RobotView(View):
    """A robot that ships with gaitswarm."""

    name: RobotName = Field(description="Name, as in job specs.", examples=["szabadka2"])
    description: str = Field(examples=["Hexapod of 18 joints, 6.76 kg"])
    """What it is, with its source."""
    parameters: list[Variable]
    """What an identification or calibration may fit of it, with bounds."""
    conventions: list[Variable]
    """Modelling choices that a calibration may vary as well."""


class ScenarioView(Scenario):
    """A preset walking scenario; 1 to 6 are those of thesis table 4.2."""

    number: int = Field(examples=[1])
    """Its number, 1 to 6 as in table 4.2; a job may name a scenario by it."""
    simulated_seconds: float = Field(description="Length of the walk [s].", examples=[4.5])


class PreferenceView(Preference):
    """A published preference (thesis table 4.5, eq. 3.1)."""

    name: PreferenceName = Field(description="Name, as in job specs.", examples=["A"])


Description = Annotated[
    str, Field(description="What it is, with its source.", examples=["Mamdani fuzzy-PI, chapter 4"])
]
CatalogueName = Annotated[str, Field(description="Name, as in job specs.", examples=["fuzzy-pi"])]


class ControllerView(View):
    """A family of motor controllers and what can be tuned in it."""

    name: CatalogueName
    description: Description
    variables: list[Variable]
    """Design variables; a job searches all that it does not hold fixed."""
    conventions: list[Variable]
    """What the thesis leaves open; a design that does not set one has its default, and a job may
    search it or hold it fixed."""
    gait_variables: list[Variable]
    """Gait parameters that a design may set as well, in place of the scenario's."""
    published: dict[str, dict[str, float | str]] = Field(
        description="Designs from the literature, by preference or study: {name: value}.",
        examples=[{"A": {"I": 0.171, "FI1R": 5837.0}}],
    )


class CaseView(View):
    """A plug-in's case: what evaluates designs in place of a walk in gaitswarm's simulator."""

    name: CatalogueName
    description: Description
    needs: str | None = Field(examples=["pip install scikit-learn"])
    """Command that installs what is missing for it here; null if nothing is."""
    settings_schema: dict[str, Any]
    """JSON schema of its settings, with defaults, bounds and descriptions."""


class OptimizerView(CaseView):
    """A search method by its default settings, or a preset of one."""

    name: OptimizerName = Field(examples=["pso-falling-inertia"])
    """Name, as in job specs."""
    settings: OptimizerSettings = Field(description="What the name stands for.")


class PluginView(View):
    """An entry point that an installed distribution has for gaitswarm."""

    kind: Kind = Field(description="What it brings.", examples=["case"])
    name: str = Field(description="Name, as in job specs.", examples=["mujoco-walk"])
    distribution: str = Field(examples=["gaitswarm-mujoco-case"])
    """Distribution that declares it."""
    version: str = Field(description="Version of the distribution.", examples=["0.1.0"])
    state: Literal["ok", "refused"] = Field(examples=["ok"])
    """Whether jobs can name it."""
    reason: str | None = Field(description="Why they cannot; null if they can.", examples=[None])


def robot_views() -> list[RobotView]:
    """The robots that ship, the default one first."""
    return [
        RobotView(
            name=name,
            description=load_robot(name).description.description,
            parameters=list(identifiable_variables(load_robot(name))),
            conventions=list(CONVENTIONAL_VARIABLES),
        )
        for name in sorted(SHIPPED, key=lambda name: name != DEFAULT_ROBOT)
    ]


def scenario_views() -> list[ScenarioView]:
    """The presets, those of table 4.2 first, in its order."""
    return [
        ScenarioView(**dict(scenario), number=number, simulated_seconds=scenario.duration)
        for number, scenario in enumerate(PRESETS, start=1)
    ]


def preference_views() -> list[PreferenceView]:
    """The preferences of table 4.5, in its order, then that of eq. 3.1."""
    return [PreferenceView(name=name, **dict(p)) for name, p in PREFERENCES.items()]


def optimizers() -> list[OptimizerView]:
    """List the search methods, and presets of them, that `optimizer` may name.

    Returns:
        Each with its description, its settings and their JSON schema.
    """
    return [
        OptimizerView(
            name=name,
            description=method.summary,
            needs=method.remedy if method.missing else None,
            settings=settings,
            settings_schema=method.settings.model_json_schema(),
        )
        for name, settings in OPTIMIZERS.items()
        for method in (METHODS[settings.name],)
    ]


def case_views() -> list[CaseView]:
    return [
        CaseView(
            name=name,
            description=family.summary,
            needs=f"pip install {' '.join(family.missing)}" if family.missing else None,
            settings_schema=family.settings.model_json_schema(),
        )
        for name, family in CASES.items()
    ]


def plugin_views() -> list[PluginView]:
    """Every entry point that is installed for gaitswarm, refused ones included."""
    registries: tuple[Registry[Any], ...] = (CONTROLLERS, CASES, METHODS)
    return [
        PluginView(
            **fields_of(PluginView, plugin),
            state="ok" if reason is None else "refused",
            reason=reason,
        )
        for registry in registries
        for plugin in registry.plugins()
        for reason in (registry.problem(plugin),)
    ]


def controller_views() -> list[ControllerView]:
    return [
        ControllerView.model_validate(
            {
                **fields_of(ControllerView, controller),
                "gait_variables": GAIT_VARIABLES,
                "published": {
                    study: design_shown(name, design)
                    for study, design in controller.published.items()
                },
            }
        )
        for name, controller in CONTROLLERS.items()
    ]
