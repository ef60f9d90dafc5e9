"""Walking scenarios (thesis table 4.2) and the gait parameters that a design may set."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Final, Literal

from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    Tag,
    ValidationError,
    model_validator,
)

from sim import former_names
from sim.choice import NAME, OWN, alternatives
from sim.errors import SimulationInputError
from sim.former_names import current_names
from sim.variables import Variable
from sim.wording import message_of

ScenarioName = Annotated[
    str,
    Field(
        min_length=1,
        max_length=60,
        pattern=r"^[A-Za-z0-9][A-Za-z0-9_.-]*$",
        description="Name of the scenario, unique in its job.",
        examples=["normal-fast"],
    ),
]


class Scenario(BaseModel):
    """One walk to be judged: gait, posture, load and ground. All fields have units.

    Fields that table 4.2 does not give have the defaults that docs/model.md explains.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    name: ScenarioName
    cycle_time: float = Field(
        ge=0.2, le=10.0, description="Duration of a walking cycle [s].", examples=[1.5]
    )
    radius: float = Field(
        gt=0.0,
        le=1.0,
        description="Lateral distance of the feet from the body's long axis [m].",
        examples=[0.16],
    )
    hip_height: float = Field(
        gt=0.0,
        le=1.0,
        description="Height of the coxa axes over the ground, the thesis's withers [m].",
        examples=[0.15],
    )
    load: float = Field(
        default=0.0, ge=0.0, le=50.0, description="Extra mass carried on the body [kg]."
    )
    direction: Literal["forward", "backward"] = Field(
        default="forward",
        description="Way that the robot walks; distance and speed count along it.",
    )
    turn: float = Field(
        default=0.0,
        ge=-1.0,
        le=1.0,
        description="Share by which the inner legs' stride is shortened [1]; right turns positive.",
    )
    turn_mode: Literal["inner", "both"] = Field(
        default="inner",
        description="Whether a turn shortens the inner legs' stride alone, or lengthens that of the"
        " outer ones by the same share as well.",
    )
    slope: float = Field(
        default=0.0,
        ge=-45.0,
        le=45.0,
        description="Inclination of the ground [deg], up positive.",
    )
    slope_direction: float = Field(
        default=0.0,
        ge=-180.0,
        le=180.0,
        description="Where the ground rises, from straight ahead towards the left [deg].",
    )
    stride: float = Field(
        default=0.06,
        gt=0.0,
        le=1.0,
        description="Length of a foot's stroke on the ground [m].",
    )
    height: float = Field(
        default=0.04,
        ge=0.0,
        le=0.5,
        description="Height of the swing [m].",
    )
    duty_factor: float = Field(
        default=0.56,
        ge=0.1,
        le=0.95,
        description="Share of the cycle of the phase that `duty_phase` names [1].",
    )
    duty_phase: Literal["support", "swing"] = Field(
        default="support", description="Phase whose share of the cycle `duty_factor` is."
    )
    start_phase: float = Field(
        default=0.0,
        ge=0.0,
        lt=1.0,
        description="Share of the cycle at which the gait begins [1]; 0.5 exchanges the tripods.",
    )
    fir_ms: int = Field(
        default=12, ge=0, le=1000, description="Length of the low-pass FIR filter [ms]."
    )
    fir_window: Literal["moving_average", "hamming"] = Field(
        default="moving_average",
        description="Coefficients of the FIR filter: all equal, or those of Matlab's fir1.",
    )
    trajectory_rate: float = Field(
        default=500.0,
        ge=1.0,
        le=500.0,
        description="Rate at which the desired angles are updated [Hz].",
    )
    curve: Literal["half_ellipse", "quadratic_spline"] = Field(
        default="quadratic_spline", description="Shape of the swing; the spline is appendix .2.1's."
    )
    cycles: float = Field(
        default=3.0, ge=1.0, le=100.0, description="Number of cycles to walk [1]."
    )
    stuck_leg: str | None = Field(
        default=None,
        min_length=1,
        max_length=60,
        description="Name of the leg whose joints are jammed at their first angles; none by"
        " default.",
        examples=["right_middle"],
    )
    drop: float = Field(
        default=0.0,
        ge=0.0,
        le=0.5,
        description="Height above its stance from which the robot is dropped at the start [m].",
    )

    shove: float = Field(
        default=0.0,
        ge=0.0,
        le=100.0,
        description="Horizontal impulse on the body in mid-walk, a constant force for 0.1 s [N s].",
    )
    shove_direction: float = Field(
        default=90.0,
        ge=-180.0,
        le=180.0,
        description="Where the shove pushes, from straight ahead at the start towards the left"
        " [deg].",
    )
    shove_at: float = Field(
        default=0.5,
        ge=0.0,
        lt=1.0,
        description="Share of the walk at which the shove begins, 0.1 s before its end at the"
        " latest [1].",
    )

    @model_validator(mode="before")
    @classmethod
    def _read_former_names(cls, document: Any) -> Any:
        return current_names(document, former_names.SCENARIO)

    @property
    def duration(self) -> float:
        """Simulated time [s]."""
        return self.cycles * self.cycle_time

    @property
    def support_share(self) -> float:
        """Support's share of the cycle [1]."""
        return self.duty_factor if self.duty_phase == "support" else 1.0 - self.duty_factor

    def stride_of(self, side: float) -> float:
        """Stride of the legs of one side [m].

        Args:
            side: 1 for the left legs, -1 for the right ones.

        Returns:
            The scenario's stride, shortened or lengthened by its turn.
        """
        shortened = -side * self.turn
        if self.turn_mode == "inner":
            shortened = max(0.0, shortened)
        return self.stride * (1.0 - shortened)


GAIT_VARIABLES: Final[tuple[Variable, ...]] = (
    Variable(name="cycle_time", low=0.9, high=1.7, unit="s", description="Walking cycle."),
    Variable(
        name="stride",
        low=0.10,
        high=0.18,
        unit="m",
        description="Stroke on the ground.",
    ),
    Variable(name="height", low=0.01, high=0.04, unit="m", description="Height of the swing."),
    Variable(
        name="duty_factor",
        low=0.45,
        high=0.75,
        unit="1",
        description="Share of the cycle of the phase that duty_phase names.",
    ),
    Variable(
        name="duty_phase",
        kind="categorical",
        choices=("support", "swing"),
        description="Phase whose share of the cycle duty_factor is.",
    ),
    Variable(
        name="start_phase",
        low=0.0,
        high=0.95,
        unit="1",
        description="Share of the cycle at which the gait begins: which legs swing first.",
    ),
    Variable(
        name="curve",
        kind="categorical",
        choices=("quadratic_spline", "half_ellipse"),
        description="Shape of the swing.",
    ),
    Variable(
        name="fir_ms",
        low=4,
        high=300,
        unit="ms",
        kind="integer",
        description="Low-pass FIR filter of the desired angles.",
    ),
    Variable(
        name="fir_window",
        kind="categorical",
        choices=("moving_average", "hamming"),
        description="Coefficients of the filter: all equal, or those of Matlab's fir1.",
    ),
    Variable(
        name="trajectory_rate",
        low=20.0,
        high=500.0,
        unit="Hz",
        description="Update rate of the desired angles.",
    ),
)
"""Gait parameters that a design may set beside the controller's, after thesis table 3.2.

A value set by a design replaces the scenario's own in every scenario.
"""

GAIT_VARIABLE_NAMES: Final = frozenset(variable.name for variable in GAIT_VARIABLES)

SCENARIOS: Final[tuple[Scenario, ...]] = (
    Scenario(name="normal-fast", cycle_time=1.5, radius=0.16, hip_height=0.15),
    Scenario(name="normal-slow", cycle_time=2.2, radius=0.16, hip_height=0.15),
    Scenario(name="loaded-fast", cycle_time=1.5, radius=0.145, hip_height=0.20, load=2.0),
    Scenario(name="loaded-slow", cycle_time=2.2, radius=0.145, hip_height=0.20, load=2.0),
    Scenario(name="slope-fast", cycle_time=1.5, radius=0.20, hip_height=0.14, slope=10.0),
    Scenario(name="turn-right-fast", cycle_time=1.5, radius=0.16, hip_height=0.15, turn=0.5),
)
"""The six scenarios of table 4.2, in its order: those that a job has unless it names others."""

_BACKWARD: Final = Scenario(
    name="backward", cycle_time=1.5, radius=0.16, hip_height=0.15, direction="backward"
)

HELD_OUT: Final[tuple[Scenario, ...]] = (
    Scenario(name="turn-left-fast", cycle_time=1.5, radius=0.16, hip_height=0.15, turn=-0.5),
    Scenario(name="half-loaded-fast", cycle_time=1.5, radius=0.145, hip_height=0.20, load=1.0),
    Scenario(name="overloaded-fast", cycle_time=1.5, radius=0.145, hip_height=0.20, load=3.0),
    Scenario(name="downhill-fast", cycle_time=1.5, radius=0.20, hip_height=0.14, slope=-10.0),
    Scenario(
        name="slope-left-fast",
        cycle_time=1.5,
        radius=0.20,
        hip_height=0.14,
        slope=10.0,
        slope_direction=90.0,
    ),
    Scenario(
        name="slope-right-fast",
        cycle_time=1.5,
        radius=0.20,
        hip_height=0.14,
        slope=10.0,
        slope_direction=-90.0,
    ),
    _BACKWARD,
    Scenario(name="shove-fast", cycle_time=1.5, radius=0.16, hip_height=0.15, shove=6.0),
)
"""Walks beside those of table 4.2, for which no design of the thesis was optimized: what a design
is worth in them shows whether it was made for its scenarios alone."""

PRESETS: Final[tuple[Scenario, ...]] = (
    *SCENARIOS,
    Scenario(name="straight", cycle_time=1.5, radius=0.16, hip_height=0.15),
    _BACKWARD,
    Scenario(name="drop", cycle_time=1.5, radius=0.16, hip_height=0.15, drop=0.03),
    Scenario(
        name="stuck-leg", cycle_time=1.5, radius=0.16, hip_height=0.15, stuck_leg="right_middle"
    ),
    *(scenario for scenario in HELD_OUT if scenario is not _BACKWARD),
)
"""All scenarios that have a name and, by their order, a number from 1 on.

`straight` is the walk of chapter 3 (section 3.1), whose designs bring a gait of their own, and
`backward` that of figs. 2.7 and 2.8; `drop` and `stuck-leg` are the protection's cases (4.3.2).
"""


def find_scenario(name: str) -> Scenario:
    """A preset.

    Args:
        name: Of the scenario, or its number in `PRESETS`; 1 to 6 are those of table 4.2.

    Returns:
        The scenario.

    Raises:
        SimulationInputError: There is none; names those that there are.
    """
    for number, scenario in enumerate(PRESETS, start=1):
        if name in (scenario.name, str(number)):
            return scenario
    known = ", ".join(f"{k} {s.name}" for k, s in enumerate(PRESETS, start=1))
    raise SimulationInputError(f"unknown scenario {name!r}; known are {known}")


def with_gait(scenario: Scenario, gait: Mapping[str, float]) -> Scenario:
    """A scenario with other gait parameters.

    Args:
        scenario: The scenario.
        gait: Values of some of `GAIT_VARIABLES` by name; of a categorical one the index of a
            choice.

    Returns:
        The scenario, or a copy of it if the gait changes anything.

    Raises:
        SimulationInputError: A value is none that a scenario can have; names the field.
    """
    if not gait:
        return scenario
    values: dict[str, float | str] = dict(gait)
    for variable in GAIT_VARIABLES:
        if variable.kind == "categorical" and variable.name in values:
            try:
                values[variable.name] = variable.shown(variable.number(values[variable.name]))
            except ValueError as error:
                raise SimulationInputError(str(error)) from error
    if "fir_ms" in values:
        if not float(values["fir_ms"]).is_integer():
            raise SimulationInputError(f"fir_ms: {values['fir_ms']:g} is not a whole number of ms")
        values["fir_ms"] = int(values["fir_ms"])
    try:
        return Scenario.model_validate(scenario.model_dump() | values)
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(str(part) for part in first["loc"])
        raise SimulationInputError(f"{where}: {message_of(first)}") from error


def _preset_exists(name: str) -> str:
    find_scenario(name)
    return name


def _number_as_name(value: object) -> object:
    """1 as "1", which `find_scenario` knows."""
    return str(value) if isinstance(value, int) and not isinstance(value, bool) else value


ScenarioChoice = Annotated[
    Annotated[ScenarioName, AfterValidator(_preset_exists), Tag(NAME)]
    | Annotated[Scenario, Tag(OWN)],
    alternatives("must be the name or number of a preset, or an object: a scenario of your own"),
    BeforeValidator(_number_as_name),
]
"""How jobs and requests choose a walk."""
