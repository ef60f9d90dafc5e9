"""Scenarios: gait, posture, load and ground of a walk; presets."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from functools import lru_cache
from importlib import resources
from types import MappingProxyType
from typing import TYPE_CHECKING, Annotated, Any, Final, Literal, Self, get_args

from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    Field,
    Tag,
    TypeAdapter,
    ValidationError,
    model_validator,
)

from gaitswarm.sim.errors import SimulationInputError
from gaitswarm.sim.input import NAME, OWN, Data, alternatives, check_distinct, message_of
from gaitswarm.sim.near_names import instead_of
from gaitswarm.sim.terrain import PLANE, Terrain
from gaitswarm.sim.variables import VariableName, split_name

USUAL_SUPPORT: Final[Mapping[str, float]] = MappingProxyType(
    {"wave": 0.85, "ripple": 0.7, "crawl": 0.85}
)
"""Default share of support in the cycle by gait [1], so that on four or six legs a foot leaves the
ground a little after another one has landed."""


def with_duty_factor(document: Any) -> Any:
    if not isinstance(document, Mapping) or "duty_factor" in document:
        return document
    support = USUAL_SUPPORT.get(str(document.get("gait")))
    if support is None:
        return document
    swings = document.get("duty_phase") == "swing"
    return {**document, "duty_factor": round(1.0 - support, 9) if swings else support}


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

GaitName = Literal[
    "own", "alternating", "tripod", "wave", "ripple", "trot", "pace", "bound", "crawl"
]
"""Order of the legs' steps; `own` is the order in the robot's description. See `sim.gait.gaits`."""

GAIT_NAMES: Final[tuple[GaitName, ...]] = get_args(GaitName)

CurveName = Literal["quadratic_spline", "half_ellipse", "cycloid"]
"""Shape of the swing, see `gaitswarm.sim.gait.curves`."""

BY_LEG_GROUP: Final = ("stride", "height", "duty_factor", "start_phase", "radius")
"""Fields that can be set for groups of legs."""


class ValuesByName(dict[str, float]):
    """Numbers by name, hashable because they never change."""

    def __hash__(self) -> int:  # type: ignore[override]
        return hash(frozenset(self.items()))


Phase = Annotated[float, Field(ge=0.0, lt=1.0)]
LegName = Annotated[str, Field(min_length=1, max_length=60)]


class Scenario(Data):
    """A walk to be simulated: gait, posture, load and ground.

    docs/model.md explains the defaults of fields that are not in table 4.2.
    """

    name: ScenarioName
    cycle_time: float = Field(ge=0.2, le=10.0, examples=[1.5])
    """Duration of a walking cycle [s]."""
    radius: float = Field(gt=0.0, le=10.0, examples=[0.16])
    """Lateral distance of the feet from the body's long axis [m]."""
    hip_height: float = Field(gt=0.0, le=10.0, examples=[0.15])
    """Height of the coxa axes above the ground, the thesis's withers [m]."""
    load: float = Field(default=0.0, ge=0.0, le=50.0)
    """Extra mass carried on the body [kg]."""
    direction: Literal["forward", "backward"] = "forward"
    """Direction of the walk; distance and speed count along it."""
    turn: float = Field(default=0.0, ge=-1.0, le=1.0)
    """Share by which the inner legs' stride is shortened [1]; right turns positive."""
    turn_mode: Literal["inner", "both"] = "inner"
    """Whether a turn only shortens the inner legs' stride, or also lengthens that of the outer legs
    by the same share."""
    slope: float = Field(default=0.0, ge=-45.0, le=45.0)
    """Inclination of the ground [deg], up positive."""
    slope_direction: float = Field(default=0.0, ge=-180.0, le=180.0)
    """Direction in which the ground rises, from straight ahead to the left [deg]."""
    terrain: Terrain = Field(default=PLANE, examples=[{"kind": "rough", "amplitude": 0.01}])
    """Shape of the ground, which controller and gait do not know."""
    stride: float = Field(default=0.06, gt=0.0, le=10.0)
    """Length of a foot's stroke on the ground [m]."""
    height: float = Field(default=0.043, ge=0.0, le=5.0)
    """Height of the swing [m]."""
    duty_factor: float = Field(
        default=0.56,
        ge=0.1,
        le=0.95,
        description="Share of the cycle of the phase selected by `duty_phase`; the default is"
        f" {', '.join(f'{share:g} in a {gait}' for gait, share in USUAL_SUPPORT.items())} [1].",
    )
    duty_phase: Literal["support", "swing"] = "support"
    """Phase to which `duty_factor` applies."""
    start_phase: float = Field(default=0.0, ge=0.0, lt=1.0)
    """Share of the cycle at which the gait starts [1]; 0.5 swaps the tripods."""
    gait: GaitName = "own"
    """Order of the legs' steps: own is the order in the robot's description; see `gaitswarm
    gaits`."""
    phases: (
        Annotated[dict[LegName, Phase], Field(max_length=32), AfterValidator(ValuesByName)] | None
    ) = Field(
        default=None,
        description="Instead of `gait`: share of the cycle since the start of support when the gait"
        " starts, by leg [1].",
        examples=[{"FL": 0.0, "FR": 0.5, "RL": 0.5, "RR": 0.0}],
    )
    by_group: (
        Annotated[dict[VariableName, float], Field(max_length=128), AfterValidator(ValuesByName)]
        | None
    ) = Field(
        default=None,
        description="Values of stride, height, duty_factor, start_phase and radius for leg groups,"
        " such as `stride[front]`; they override the scenario's.",
        examples=[{"stride[front]": 0.05, "height[hind]": 0.03}],
    )
    fir_ms: int = Field(default=12, ge=0, le=1000)
    """Length of the low-pass FIR filter [ms]."""
    fir_window: Literal["moving_average", "hamming"] = "moving_average"
    """Coefficients of the FIR filter: all equal, or those of Matlab's fir1."""
    trajectory_rate: float = Field(default=500.0, ge=1.0, le=500.0)
    """Rate at which the desired angles are updated [Hz]."""
    curve: CurveName = "half_ellipse"
    """Shape of the swing; the spline is that of the drive of 2011 (appendix .2.1)."""
    sway_lateral: float = Field(default=0.0, ge=-0.3, le=0.3)
    """Amplitude of the body's sway to the left and right, once per cycle [m]."""
    sway_longitudinal: float = Field(default=0.0, ge=-0.3, le=0.3)
    """Amplitude of the body's sway along the walk, twice per cycle [m]."""
    sway_phase: float = Field(default=0.5, ge=0.0, lt=1.0)
    """Share of the gait's cycle at which the body is furthest to the left [1]."""
    cycles: float = Field(default=3.0, ge=1.0, le=100.0)
    """Number of cycles to walk [1]."""
    stuck_leg: str | None = Field(
        default=None,
        min_length=1,
        max_length=60,
        description="Name of the leg whose joints are jammed at their start angles; default: none.",
        examples=["right_middle"],
    )
    drop: float = Field(default=0.0, ge=0.0, le=0.5)
    """Height above its stance from which the robot is dropped at the start [m]."""

    shove: float = Field(default=0.0, ge=0.0, le=100.0)
    """Horizontal impulse on the body in mid-walk, a constant force for 0.1 s [N s]."""
    shove_direction: float = Field(default=90.0, ge=-180.0, le=180.0)
    """Direction of the shove, from straight ahead at the start to the left [deg]."""
    shove_at: float = Field(default=0.5, ge=0.0, lt=1.0)
    """Share of the walk at which the shove starts, 0.1 s before the end at latest."""

    @model_validator(mode="before")
    @classmethod
    def _add_duty_factor(cls, document: Any) -> Any:
        return with_duty_factor(document)

    @model_validator(mode="after")
    def _gait_is_one(self) -> Scenario:
        if self.phases is not None and self.gait != "own":
            raise ValueError(f"phases: the gait {self.gait} has its own; set one of them only")
        for name, value in (self.by_group or {}).items():
            base, group = split_name(name)
            if base not in BY_LEG_GROUP or group is None:
                raise ValueError(
                    f"by_group.{name}: not a value of leg groups; those are"
                    f" {', '.join(f'{known}[GROUP]' for known in BY_LEG_GROUP)}"
                )
            try:
                _bounds_of(base).validate_python(value)
            except ValidationError as error:
                raise ValueError(f"by_group.{name}: {message_of(error.errors()[0])}") from error
        return self

    @property
    def duration(self) -> float:
        """Simulated time [s]."""
        return self.cycles * self.cycle_time

    @property
    def support_share(self) -> float:
        """Share of support in the cycle for legs without a duty factor of their group [1]."""
        return self.support_share_of(self.duty_factor)

    def support_share_of(self, duty_factor: float) -> float:
        """Return the share of support in the cycle [1].

        Args:
            duty_factor: Share of the phase that `duty_phase` selects.
        """
        return duty_factor if self.duty_phase == "support" else 1.0 - duty_factor

    def stride_of(self, side: float, stride: float | None = None) -> float:
        """Return the stride of the legs of one side in the scenario's turn [m].

        Args:
            side: 1 for the left legs, -1 for the right ones.
            stride: Stride straight ahead [m]; default: the scenario's.
        """
        shortened = -side * self.turn
        if self.turn_mode == "inner":
            shortened = max(0.0, shortened)
        return (self.stride if stride is None else stride) * (1.0 - shortened)


@lru_cache
def _bounds_of(field: str) -> TypeAdapter[float]:
    return TypeAdapter(Annotated[float, Scenario.model_fields[field]])


_PRESETS: Final = tomllib.loads(
    (resources.files("gaitswarm.sim") / "presets.toml").read_text(encoding="utf-8")
)

PRESETS: Final = tuple(map(Scenario.model_validate, _PRESETS["scenario"]))
"""All named scenarios; their position from 1 is their number."""

SCENARIOS: Final = PRESETS[:6]
"""The six scenarios of table 4.2 in its order, the default of jobs."""


def find_scenario(name: str | Scenario) -> Scenario:
    """Return a preset by name or number; a scenario in full as it is."""
    if isinstance(name, Scenario):
        return name
    for number, scenario in enumerate(PRESETS, start=1):
        if name in (scenario.name, str(number)):
            return scenario
    names = [scenario.name for scenario in PRESETS]
    listed = (f"{k} {known}" for k, known in enumerate(names, start=1))
    raise SimulationInputError(f"unknown scenario {name!r}; {instead_of(name, names, listed)}")


HELD_OUT: Final = tuple(map(find_scenario, _PRESETS["held_out"]))
"""Scenarios for which no design of the thesis was optimized: they show whether a design is good
only in its own scenarios."""


def _preset_exists(name: str) -> str:
    find_scenario(name)
    return name


def _number_as_name(value: object) -> object:
    """Convert 1 to "1", which `find_scenario` accepts."""
    return str(value) if isinstance(value, int) and not isinstance(value, bool) else value


ScenarioChoice = Annotated[
    Annotated[ScenarioName, AfterValidator(_preset_exists), Tag(NAME)]
    | Annotated[Scenario, Tag(OWN)],
    alternatives("must be the name or number of a preset, or an object: a custom scenario"),
    BeforeValidator(_number_as_name),
]
"""A scenario in jobs and requests."""


class Scenarios(BaseModel):
    """Scenarios of a request or of a job; each declares the field with its defaults."""

    if TYPE_CHECKING:
        scenarios: tuple[ScenarioChoice, ...]

    @model_validator(mode="after")
    def _scenarios_differ(self) -> Self:
        check_distinct("scenarios", [scenario.name for scenario in self.resolved_scenarios()])
        return self

    def resolved_scenarios(self) -> tuple[Scenario, ...]:
        """Return the scenarios with presets resolved."""
        return tuple(map(find_scenario, self.scenarios))
