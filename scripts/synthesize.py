"""Synthetic logs: what the instruments of a perturbed twin of a robot would have measured.

    python -m scripts.synthesize --design published:A --scenario 1 --seed 1 --output walk.csv

No log of Szabad(ka)-II is public. Synthetic ones serve to test the toolkit and the identification
of parameters, whose true values are known here; they say nothing about the model's accuracy.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Final

import numpy as np
import typer
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field, FiniteFloat

from gaitswarm.cli.commands.measurements import WalkOptions, read_truth
from gaitswarm.cli.exit_codes import exit_code, explanation
from gaitswarm.cli.options import Place, expanded
from gaitswarm.cli.output import note, replacing
from gaitswarm.services.optimizer.errors import InvalidRequest
from gaitswarm.sim.controllers.fixed_point import CONTROL_PERIOD
from gaitswarm.sim.errors import SimulationInputError
from gaitswarm.sim.measurement.measured_log import (
    ORIGIN,
    SYNTHETIC,
    MeasuredLog,
    Quantity,
    simulated_log,
)
from gaitswarm.sim.outcome import Status
from gaitswarm.sim.robot.description import AnyActuator, Contact, TorqueActuator
from gaitswarm.sim.robot.identifiable import identifiable_variables, with_parameters
from gaitswarm.sim.robot.robot import Robot
from gaitswarm.sim.scenario import Scenario
from gaitswarm.sim.simulate import simulate
from gaitswarm.sim.variables import VariableName
from scripts.measured_logs import format_mcap, format_measured_log, format_npz

Floats = NDArray[np.float64]

ADC_BITS: Final = 12
"""Of the converter of the motor currents (thesis 5.2)."""

WARNING: Final = "computed by a perturbed simulation, NOT measured on a robot"
"""In the metadata of every synthetic log."""

_STREAMS: Final = {quantity: index for index, quantity in enumerate(Quantity)}


class Perturbation(BaseModel):
    """Differences of the twin from the robot as described. Factors multiply the described value."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    supply_voltage: float = Field(default=0.95, gt=0.0, description="factor, battery")
    supply_resistance: float = Field(default=1.3, ge=0.0, description="factor, battery")
    efficiency: float = Field(default=0.85, gt=0.0, description="factor, all gearheads; at most 1")
    motor_friction: float = Field(default=1.2, ge=0.0, description="factor, all motors")
    ground_friction: float = Field(default=0.8, ge=0.0, description="factor, all feet")
    stiffness: float = Field(default=0.8, gt=0.0, description="factor, all soles")
    damping: float = Field(default=1.2, ge=0.0, description="factor, all soles")
    backlash: float = Field(default=0.02, ge=0.0, le=0.5, description="of every joint [rad]")
    body_mass: float | None = Field(
        default=None, gt=0.0, description="in place of the described one [kg]"
    )
    parameters: dict[VariableName, FiniteFloat] = Field(
        default_factory=dict,
        description="Values of single parameters (`identifiable_variables`), after the factors",
    )

    @classmethod
    def of(cls, parameters: Mapping[str, float]) -> Perturbation:
        """A twin that differs only in single parameters, and has no backlash."""
        return cls(
            supply_voltage=1.0,
            supply_resistance=1.0,
            efficiency=1.0,
            motor_friction=1.0,
            ground_friction=1.0,
            stiffness=1.0,
            damping=1.0,
            backlash=0.0,
            parameters=dict(parameters),
        )


class Instruments(BaseModel):
    """Errors of the instruments. Noise is Gaussian, given by its standard deviation."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    current_noise: float = Field(default=0.02, ge=0.0, description="[A], before the converter")
    supply_noise: float = Field(default=0.03, ge=0.0, description="[V]")
    potentiometer_noise: float = Field(default=0.005, ge=0.0, description="[rad]")
    acceleration_noise: float = Field(default=0.005, ge=0.0, description="[g]")
    rate_noise: float = Field(default=0.01, ge=0.0, description="gyroscope [rad/s]")
    battery_noise: float = Field(default=0.05, ge=0.0, description="current of the battery [A]")
    torque_noise: float = Field(default=0.05, ge=0.0, description="[N m]")
    lead: float = Field(
        default=0.124, ge=0.0, le=10.0, description="standing logged before the walk begins [s]"
    )
    clock_offset: float = Field(default=0.37, description="time of the first row [s]")
    potentiometer_legs: tuple[int, ...] = Field(
        default=(0, 2), description="indices of the legs with potentiometers: legs 1 and 3"
    )


def synthetic_log(
    robot: Robot,
    scenario: Scenario,
    controller: str,
    design: Mapping[str, float],
    *,
    seed: int,
    perturbation: Perturbation | None = None,
    instruments: Instruments | None = None,
) -> MeasuredLog:
    """Simulate a log of the perturbed twin of a robot, marked as synthetic in its metadata.

    Equal arguments give equal bits; each quantity has its nominal random stream, by seed.
    """
    if not 0 <= seed < 1 << 64:
        raise SimulationInputError(f"seed: {seed} must be 0 to 2^64 - 1")
    errors = instruments or Instruments()
    change = perturbation or Perturbation()
    twin = perturbed(robot, change)
    values = np.array([list(design.values())], dtype=np.float64)
    # Its controller plans for the robot as described, without knowing the true parameters.
    walk = simulate(scenario, controller, list(design), values, robot=twin, planner=robot, log=True)
    status, log = Status(int(walk.outcome.statuses[0])), walk.logs[0]
    if status not in (Status.OK, Status.STALLED) or log is None:
        raise SimulationInputError(f"the perturbed twin did not finish the walk: {status.phrase}")
    standing = round(errors.lead / CONTROL_PERIOD)
    return replace(
        _measured(robot, _after_standing(simulated_log(twin, log), standing), errors, seed),
        metadata={
            ORIGIN: SYNTHETIC,
            "warning": WARNING,
            "robot": robot.description.name,
            "scenario": scenario.name,
            "controller": controller,
            "seed": str(seed),
            "perturbation": _listed(change),
            "instruments": _listed(errors),
        },
    )


def perturbed(robot: Robot, change: Perturbation) -> Robot:
    """The twin: the same robot with other friction, losses, backlash, battery and soles."""
    d = robot.description

    def contact(nominal: Contact) -> Contact:
        return nominal.model_copy(
            update={
                "friction": nominal.friction * change.ground_friction,
                "stiffness": nominal.stiffness * change.stiffness,
                "damping": nominal.damping * change.damping,
            }
        )

    description = d.model_copy(
        update={
            "body_mass": d.body_mass if change.body_mass is None else change.body_mass,
            "supply": d.supply.model_copy(
                update={
                    "voltage": d.supply.voltage * change.supply_voltage,
                    "resistance": d.supply.resistance * change.supply_resistance,
                }
            ),
            "gearheads": {
                name: gear.model_copy(
                    update={"efficiency": min(1.0, gear.efficiency * change.efficiency)}
                )
                for name, gear in d.gearheads.items()
            },
            "motors": {
                name: motor.model_copy(
                    update={"viscous_friction": motor.viscous_friction * change.motor_friction}
                )
                for name, motor in d.motors.items()
            },
            "actuators": {
                name: actuator.model_copy(
                    update={"backlash": change.backlash} | _actuator_friction(actuator, change)
                )
                for name, actuator in d.actuators.items()
            },
            "contact": contact(d.contact),
            "legs": tuple(
                leg.model_copy(update={"contact": contact(leg.contact)}) if leg.contact else leg
                for leg in d.legs
            ),
        }
    )
    return with_parameters(replace(robot, description=description), change.parameters)


def _actuator_friction(actuator: AnyActuator, change: Perturbation) -> dict[str, float]:
    """Friction of an actuator in addition to its motor's."""
    if not isinstance(actuator, TorqueActuator):
        return {}
    return {"viscous_friction": actuator.viscous_friction * change.motor_friction}


def _listed(values: BaseModel) -> str:
    return ", ".join(f"{name}={value}" for name, value in values.model_dump().items())


def _after_standing(log: MeasuredLog, rows: int) -> MeasuredLog:
    """Prepend rows like the first: the walk starts at rest."""
    time = np.arange(rows + len(log.time), dtype=np.float64) * CONTROL_PERIOD
    held = log.mapped(lambda column: np.concatenate([np.repeat(column[:1], rows, axis=0), column]))
    return replace(held, time=time)


def _measured(robot: Robot, log: MeasuredLog, errors: Instruments, seed: int) -> MeasuredLog:
    """Apply the instruments: noise, then the converters' resolution. Digital signals are exact."""
    sensors = robot.description.sensors

    def noisy(quantity: Quantity, deviation: float) -> Floats:
        # Keyed by quantity: changing the noise of one leaves the others' bits unchanged.
        key = np.array([seed, _STREAMS[quantity]], dtype=np.uint64)
        stream = np.random.Generator(np.random.Philox(key=key))
        exact = log.values(quantity)
        return exact + deviation * stream.standard_normal(exact.shape)

    with_potentiometer = [
        joint
        for k, leg in enumerate(robot.description.legs)
        if k in errors.potentiometer_legs
        for joint in leg.joints
    ]
    columns = [log.potentiometer_joints.index(joint) for joint in with_potentiometer]
    angle_step = sensors.angle_step / sensors.angle_counts
    return replace(
        log,
        time=log.time + errors.clock_offset,
        joint_angle=np.rint(log.joint_angle / angle_step) * angle_step,
        current=converted(
            noisy(Quantity.CURRENT, errors.current_noise),
            sensors.current_step / sensors.current_counts,
        ),
        supply=noisy(Quantity.SUPPLY, errors.supply_noise),
        potentiometer_joints=tuple(with_potentiometer),
        potentiometer=noisy(Quantity.POTENTIOMETER, errors.potentiometer_noise)[:, columns],
        body_acceleration=noisy(Quantity.BODY_ACCELERATION, errors.acceleration_noise),
        body_rate=noisy(Quantity.BODY_RATE, errors.rate_noise),
        battery_current=noisy(Quantity.BATTERY_CURRENT, errors.battery_noise),
        torque=log.torque if log.torque is None else noisy(Quantity.TORQUE, errors.torque_noise),
    )


def converted(amperes: Floats, step: float) -> Floats:
    """Quantise absolute currents [A] like a 12-bit converter: steps 0 to 4095."""
    return np.clip(np.rint(amperes / step), 0, (1 << ADC_BITS) - 1) * step


def synthesize(
    options: WalkOptions,
    output: Annotated[
        Path, typer.Option("--output", "-o", metavar="FILE", help="Where to write the log.")
    ],
    seed: Annotated[
        int, typer.Option(min=0, max=(1 << 64) - 1, help="Seed of the sensor noise.")
    ] = 1,
    parameters: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE.json",
            help="Parameter values by name; the twin differs only in these.",
        ),
    ] = None,
    *,
    place: Place,
) -> None:
    """Write a SYNTHETIC log of a perturbed twin of the robot with sensor noise, for tests."""
    formats: dict[str, Callable[[MeasuredLog], bytes]] = {
        ".csv": lambda log: format_measured_log(log).encode(),
        ".npz": format_npz,
        ".mcap": format_mcap,
    }
    if output.suffix not in formats:
        raise InvalidRequest(f"{output} must end in {', '.join(formats)}", field="output")
    walk = options.read(place)
    twin = None
    if parameters is not None:
        names = {variable.name for variable in identifiable_variables(walk.robot)}
        values = read_truth(parameters)
        for name in values:
            if name not in names:
                raise InvalidRequest("no such parameter of the robot", field=f"parameters.{name}")
        twin = Perturbation.of(values)
    log = synthetic_log(
        walk.robot, walk.scenario, walk.controller, walk.design, seed=seed, perturbation=twin
    )
    with replacing(output, "output") as file:
        file.write(formats[output.suffix](log))
    note(f"SYNTHETIC log of {len(log.time)} rows written to {output}")


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command and return its exit code."""
    app = typer.Typer(pretty_exceptions_enable=False, add_completion=False)
    app.command()(expanded(synthesize))
    try:
        app(arguments, standalone_mode=False)
    except Exception as error:
        code = exit_code(error)
        if code is None:
            raise
        note(explanation(error))
        return code
    return 0


if __name__ == "__main__":
    sys.exit(main())
