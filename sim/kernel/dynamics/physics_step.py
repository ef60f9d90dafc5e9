"""A physics step of a whole robot as CasADi functions, derived from Pinocchio's model.

The reference kernel steps with them, logs are computed by them, and the tests compare them with
Pinocchio and MuJoCo. The compiled kernel has the same formulas limb by limb
(`gaitswarm.sim.kernel.emitted.pieces`).
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache, reduce
from typing import Any, Final, Generic, TypeVar, TypeVarTuple
from weakref import WeakValueDictionary

import casadi as ca
import numpy as np
import pinocchio as pin

from gaitswarm.sim.kernel.dynamics.articulated_body import (
    LinkState,
    body_integrands,
    body_lean,
    body_of,
    body_state,
    drifted,
    pushed,
    solved,
)
from gaitswarm.sim.kernel.dynamics.drives import battery_voltage
from gaitswarm.sim.kernel.dynamics.kinds import LimbKind, limb_kinds
from gaitswarm.sim.kernel.dynamics.limb import (
    After,
    Before,
    Environment,
    LimbState,
    Scalars,
    after,
    before,
    place,
)
from gaitswarm.sim.kernel.dynamics.spatial import Force, Scalar, add, leaves, mapped
from gaitswarm.sim.kernel.parameters import Layout, internal_state_size
from gaitswarm.sim.robot.description import JOINTS_PER_LEG
from gaitswarm.sim.robot.legs import Placement
from gaitswarm.sim.robot.limbs import Limb, electrical_constants, limb_of, limbs_of
from gaitswarm.sim.robot.robot import Robot
from gaitswarm.sim.robot.urdf import BodyInertia

Trees = TypeVarTuple("Trees")
T = TypeVar("T")


class Traced(Generic[*Trees, T]):
    """A function of trees that runs once in Python and is then repeated by CasADi.

    Building an expression scalar by scalar in Python takes much longer than repeating it for other
    scalars. Zeros and ones are still dropped. A quotient whose divisor is first a symbol and later
    a number remains a quotient, whereas Python's CasADi multiplies by the inverse.
    """

    def __init__(self, function: Callable[[*Trees], T], *examples: *Trees) -> None:
        self._given = [_is_symbolic(leaf) for leaf in leaves(examples)]
        symbols = mapped(examples, lambda leaf: ca.SX.sym("x") if _is_symbolic(leaf) else leaf)
        self._made = function(*symbols)
        self._function = ca.Function(
            "traced",
            [ca.vertcat(*filter(_is_symbolic, leaves(symbols)))],
            [ca.vertcat(*filter(_is_symbolic, leaves(self._made)))],
        )

    def __call__(self, *arguments: *Trees) -> T:
        pairs = zip(leaves(arguments), self._given, strict=True)
        given: Any = ca.vertcat(*(leaf for leaf, taken in pairs if taken))
        results = iter(ca.vertsplit(self._function(given)))
        return mapped(self._made, lambda leaf: next(results) if _is_symbolic(leaf) else leaf)


def outline(tree: object) -> str:
    """Everything of a tree but its symbols: trees with equal outlines are traced alike."""
    return repr(mapped(tree, lambda leaf: "symbol" if _is_symbolic(leaf) else float(leaf)))


def _is_symbolic(leaf: Scalar) -> bool:
    """True also for a number in CasADi's type: another limb may have a symbol there."""
    return isinstance(leaf, ca.SX)


class PhysicsModel:
    """CasADi functions of one robot, derived on first use.

    Inputs: q (7+J): position, quaternion x y z w, joint angles; v (6+J): base twist in its own
    frame, joint rates; internal_state (I), see `parameters.internal_state_size`; duty (J): motor
    voltage per supply voltage, or torque per torque limit; disturbance (J): torque on each link [N
    m], or, with the parameter `displaced`, additional angle [rad] of its gearhead; parameters (P),
    see `parameters.Layout`; on uneven ground patches (3 L), see `contact.foot_on_ground`.
    """

    def __init__(self, robot: Robot, *, uneven: bool = False) -> None:
        self.layout = Layout(robot)
        self._robot = robot
        self._limbs = _limbs_by_pinocchio(robot)
        # Everything that the functions depend on.
        drives = robot.description.contact_law, robot.is_torque_controlled, uneven
        self.kind = outline(self._limbs), str(self.layout.slices), *drives
        self._symbols = _symbols(robot, self.layout, uneven=uneven)

    @cached_property
    def kick(self) -> Any:
        """v and internal state after a step at these positions; current (J), integrands (9), peaks
        (4) and heights of the soles (L) at its middle; landing (1), 1 if a foot may touch down
        within `limb.LANDING_HORIZON`.
        """
        step = self._step(self._symbols.p["timestep"][0])
        return _function(
            "kick",
            self._symbols.inputs,
            [
                step.velocity,
                step.internal_state,
                step.by_joint("currents"),
                step.integrands(),
                [reduce(ca.fmax, step.tally(6)), reduce(ca.fmax, step.tally(7)), *step.lean],
                step.tally(9),
                [reduce(ca.fmax, step.tally(8))],
            ],
        )

    @cached_property
    def drift(self) -> Any:
        """(q, v, internal state, time (1) [s]) -> q and internal state after that time."""
        s, n = self._symbols, self._robot.n_joints
        time = ca.SX.sym("time")
        motors = s.internal_state[: 2 * n] if self._robot.has_backlash else []
        angles = [angle + time * rate for angle, rate in zip(motors[:n], motors[n:], strict=True)]
        return _function(
            "drift",
            (*s.inputs[:3], time),
            [drifted(s.q, s.v, time), [*angles, *s.internal_state[len(angles) :]]],
        )

    @cached_property
    def places(self) -> Any:
        """q -> feet and knees in the world, (6 L): see `limb.place`."""
        q = self._symbols.q
        legs = [_of_limb(q[7:], k, len(self._limbs)) for k in range(len(self._limbs))]
        placed = [place(limb, q, leg) for limb, leg in zip(self._limbs, legs, strict=True)]
        return _function("places", self._symbols.inputs[:1], [[x for leg in placed for x in leg]])

    @cached_property
    def observe(self) -> Any:
        """Current (J), voltage (J), load torque (J), foot force in the world (3 L), supply (1) and
        acceleration (6+J) as in `pinocchio.aba`, all at this instant.
        """
        # With a zero timestep, velocity-dependent forces are those of the given velocities.
        still = self._step(0.0)
        return _function(
            "observe",
            self._symbols.inputs,
            [
                still.by_joint("currents"),
                [drive.voltage for limb in still.before for drive in limb.held.drives],
                still.by_joint("loads"),
                [component for limb in still.before for component in limb.foot_force],
                [still.supply],
                [*still.acceleration, *still.by_joint("accelerations")],
            ],
        )

    def _step(self, timestep: Scalar) -> _Step:
        robot, limbs, layout, s = self._robot, self._limbs, self.layout, self._symbols
        n, law = robot.n_joints, robot.description.contact_law
        motors = s.internal_state[: 2 * n] if robot.has_backlash else []
        rest = s.internal_state[len(motors) :]
        springs, loads = (rest[:n], rest[n : 2 * n]) if robot.has_dry_friction else ([], [])
        carried = rest[len(springs) + len(loads) :]
        joints = [joint for limb in limbs for joint in limb.joints]
        supply = battery_voltage(
            electrical_constants(joints),
            s.duty,
            motors[n:] or s.v[6:],
            s.p["supply_voltage"][0],
            s.p["supply_resistance"][0],
            torque=robot.is_torque_controlled,
        )
        environment = Environment(timestep, supply, *s.p["displaced"])
        state, body = body_state(s.q, s.v, s.p["gravity"]), body_of(s.p)

        def limb_before(
            limb: Limb,
            base: LinkState,
            state: LimbState,
            around: Environment,
            p: tuple[Scalars, ...],
        ) -> Before:
            return before(limb, law, base, state, around, dict(zip(layout.by_limb, p, strict=True)))

        before_of = _ByKind(limbs, limb_before, law, *layout.by_limb)
        after_of = _ByKind(limbs, after)
        gears = motors[:n], motors[n:], springs, loads
        parts = s.q[7:], s.v[6:], s.duty, s.disturbance, *gears, carried, s.patches
        befores = [
            before_of(
                k,
                state,
                LimbState(*(_of_limb(values, k, len(limbs)) for values in parts)),
                environment,
                tuple(_of_limb(s.p[name], k, len(limbs)) for name in layout.by_limb),
            )
            for k in range(len(limbs))
        ]
        inertia, force = body.inertia(), state.force(body)
        force = Force(add(force.linear, pushed(state, s.p["push"])), force.angular)
        for limb in befores:
            inertia, force = inertia.plus(limb.inertia), force.plus(limb.force)
        falling, true = solved(state, inertia, force)
        afters = [
            after_of(k, limb.held, falling, _of_limb(s.v[6:], k, len(limbs)), timestep)
            for k, limb in enumerate(befores)
        ]
        twist = [*true.linear, *true.angular]
        faster = [old + timestep * rate for old, rate in zip(s.v[:6], twist, strict=True)]
        return _Step(
            supply=supply,
            before=befores,
            after=afters,
            acceleration=twist,
            velocity=[*faster, *(rate for limb in afters for rate in limb.rates)],
            internal_state=[
                *motors[:n],
                *(rate for limb in befores for rate in limb.motor_rates),
                *(spring for limb in befores for spring in limb.springs),
                *(load for limb in afters for load in limb.loads if springs),
                *(value for limb in befores for value in limb.carried),
            ],
            of_body=body_integrands(state, true, timestep),
            lean=body_lean(state),
        )


@lru_cache(maxsize=16)
def physics_model(robot: Robot, *, uneven: bool = False) -> PhysicsModel:
    """Return a robot's model; robots that differ in run-time parameters alone share one."""
    model = PhysicsModel(robot, uneven=uneven)
    return _models.setdefault(model.kind, model)


_models: Final[WeakValueDictionary[Hashable, PhysicsModel]] = WeakValueDictionary()


@dataclass(frozen=True, slots=True)
class _Symbols:
    q: list[Scalar]
    v: list[Scalar]
    internal_state: list[Scalar]
    duty: list[Scalar]
    disturbance: list[Scalar]
    p: dict[str, list[Scalar]]
    patches: list[Scalar]
    inputs: tuple[Any, ...]


@dataclass(frozen=True, slots=True)
class _Step:
    supply: Scalar
    before: Sequence[Before]
    after: Sequence[After]
    acceleration: Sequence[Scalar]
    velocity: Sequence[Scalar]
    internal_state: Sequence[Scalar]
    of_body: Sequence[Scalar]
    lean: Sequence[Scalar]

    def by_joint(self, name: str) -> list[Scalar]:
        return [value for limb in self.after for value in getattr(limb, name)]

    def tally(self, k: int) -> list[Scalar]:
        """Tally k of every limb."""
        return [limb.tallies[k] for limb in self.after]

    def integrands(self) -> list[Scalar]:
        load, power, *others = (sum(self.tally(k)) for k in range(6))
        acceleration, angular, forward = self.of_body
        return [load * load, acceleration, angular, power, forward, *others]


_traces: Final[dict[Hashable, Any]] = {}
"""Traced functions by everything they depend on, shared with other robots."""

_MAX_TRACES: Final = 64

_tracing: Final = threading.Lock()


class _ByKind(Generic[*Trees, T]):
    """A function of limbs, traced once per kind."""

    def __init__(
        self, limbs: Sequence[Limb], function: Callable[[Limb, *Trees], T], *given: str
    ) -> None:
        self._limbs = list(zip(limbs, limb_kinds(limbs), strict=True))
        self._function, self._given = function, (function.__qualname__, *given)
        self._traced: dict[LimbKind, Traced[Scalars, *Trees, T]] = {}

    def __call__(self, number: int, *arguments: *Trees) -> T:
        limb, kind = self._limbs[number]
        constants: Scalars = tuple(kind.numbers_of(limb))
        if kind not in self._traced:
            key = self._given, kind, outline(arguments)
            with _tracing:
                traced = _traces.pop(key, None) or self._trace(limb, kind, *arguments)
                self._traced[kind] = _traces[key] = traced
                if len(_traces) > _MAX_TRACES:
                    del _traces[next(iter(_traces))]
        return self._traced[kind](constants, *arguments)

    def _trace(self, limb: Limb, kind: LimbKind, *arguments: *Trees) -> Traced[Scalars, *Trees, T]:
        def of_constants(symbols: Scalars, *rest: *Trees) -> T:
            return self._function(kind.symbolic(limb, symbols), *rest)

        examples: Scalars = tuple(ca.SX.sym("constant") for _ in kind.numbers_of(limb))
        return Traced(of_constants, examples, *arguments)


def _of_limb(values: Sequence[Scalar], k: int, n_limbs: int) -> tuple[Scalar, ...]:
    size = len(values) // n_limbs
    return tuple(values[k * size : (k + 1) * size])


def _symbols(robot: Robot, layout: Layout, *, uneven: bool) -> _Symbols:
    n = robot.n_joints
    sizes = {
        "q": 7 + n,
        "v": 6 + n,
        "internal_state": internal_state_size(robot),
        "duty": n,
        "disturbance": n,
        "p": layout.size,
    }
    if uneven:
        sizes["patches"] = 3 * len(robot.legs)
    inputs = tuple(ca.SX.sym(name, size) for name, size in sizes.items())
    q, v, internal_state, duty, disturbance, p, *patches = (
        [s[k] for k in range(s.numel())] for s in inputs
    )
    fields = {name: p[where] for name, where in layout.slices.items()}
    return _Symbols(
        q, v, internal_state, duty, disturbance, fields, [x for p in patches for x in p], inputs
    )


def _limbs_by_pinocchio(robot: Robot) -> tuple[Limb, ...]:
    """The limbs as Pinocchio reads the URDF."""
    limbs_of(robot)  # Raises for robots that cannot be simulated.
    model = pin.buildModelFromXML(robot.urdf.text, pin.JointModelFreeFlyer())
    limbs = []
    for number, leg in enumerate(robot.description.legs):
        placements = []
        for name in leg.joints:
            j = model.getJointId(name)
            inertia = model.inertias[j]
            placements.append(
                Placement(
                    np.asarray(model.joints[j].createData().S).reshape(-1)[3:],
                    np.asarray(model.jointPlacements[j].rotation),
                    np.asarray(model.jointPlacements[j].translation),
                    BodyInertia(
                        float(inertia.mass), np.asarray(inertia.lever), np.asarray(inertia.inertia)
                    ),
                )
            )
        foot = model.frames[model.getFrameId(leg.foot)].placement.translation
        limbs.append(limb_of(robot, number, placements, np.asarray(foot)))
    assert len(limbs[0].joints) == JOINTS_PER_LEG  # noqa: S101
    return tuple(limbs)


def _function(name: str, inputs: Sequence[Any], outputs: list[Sequence[Scalar]]) -> Any:
    return ca.Function(name, list(inputs), [ca.vertcat(*o) for o in outputs], {"cse": True})
