"""A physics step in pieces: C functions of the body and of each kind of limb, called in a loop"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import fields
from importlib import resources
from itertools import accumulate
from string import Template
from typing import Any, Final, NamedTuple, TypeVar

import casadi as ca

from gaitswarm.sim.kernel.dynamics.articulated_body import (
    body_integrands,
    body_lean,
    body_of,
    body_state,
    pushed,
    solved,
)
from gaitswarm.sim.kernel.dynamics.drives import battery_voltage
from gaitswarm.sim.kernel.dynamics.kinds import LimbKind, limb_kinds
from gaitswarm.sim.kernel.dynamics.limb import Environment, LimbState, after, before, place
from gaitswarm.sim.kernel.dynamics.spatial import Force, Inertia, Motion, Scalar, leaves, mapped
from gaitswarm.sim.kernel.emitted.emit_c import emit_c
from gaitswarm.sim.kernel.parameters import CONTACT_LAWS, Layout, internal_state_size
from gaitswarm.sim.robot.description import JOINTS_PER_LEG
from gaitswarm.sim.robot.limbs import Limb, limbs_of
from gaitswarm.sim.robot.robot import Robot

T = TypeVar("T")

_FORCE: Final = 21
"""Index of the force in what a limb passes to the body, an inertia (6 + 9 + 6) and a force (6)."""

_PASSED: Final = _FORCE + 6

_N_TALLIES: Final = 10

_CONSTANTS: Final = "constants"
"""Name of the input shared by all walks."""

_UPPER: Final = ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2))
"""Upper triangle of a symmetric matrix."""


def kernel_pieces(robot: Robot, *, uneven: bool = False) -> str:
    """C source of `kick` for a robot, on uneven ground also of `place_feet`."""
    return _Pieces(robot, uneven=uneven).text()


class _Input(NamedTuple):
    """An input of a piece: its length and its address in C."""

    size: int
    at: str


class _Pieces:
    def __init__(self, robot: Robot, *, uneven: bool) -> None:
        self._robot, self._uneven = robot, uneven
        self._n = robot.n_joints
        self._layout = Layout(robot)
        self._law = robot.description.contact_law
        self._carried = CONTACT_LAWS[self._law].internal_state_size
        limbs = limbs_of(robot)
        kinds = limb_kinds(limbs)
        # A limb of each kind.
        self._kinds: dict[LimbKind, Limb] = {}
        for limb, kind in zip(limbs, kinds, strict=True):
            self._kinds.setdefault(kind, limb)
        counts = [len(kind.numbers_of(limb)) for limb, kind in zip(limbs, kinds, strict=True)]
        *starts, self._end = accumulate(counts, initial=2 * self._n)
        distinct = list(self._kinds)
        self._tables = {
            "limbs": len(limbs),
            "starts": ", ".join(map(str, starts)),
            "kinds": ", ".join(str(distinct.index(kind)) for kind in kinds),
        }
        state = _symbols({"q": _Input(7, ""), "v": _Input(6, ""), "gravity": _Input(3, "")})
        self._any_body = body_state(**state)
        self._body = _Input(len(_varying(self._any_body)), "body")
        self._text: list[str] = []

    def text(self) -> str:
        servos = 4 * self._n * (self._robot.servos is not None)
        self._text += [f"#define SERVOS {self._end}", f"#define NR {self._end + servos}"]
        before_limbs, push, solve = self._before_limbs(), self._push_body(), self._solve_body()
        limbs = [self._limb(*numbered) for numbered in enumerate(self._kinds.items())]
        self._fill(
            "kick.c",
            held=max(held for _, _, held in limbs),
            joints=JOINTS_PER_LEG,
            before_limbs=before_limbs,
            push_body=push,
            solve_body=solve,
            body=self._body.size,
            passed=_PASSED,
            tallies=_N_TALLIES,
            before_calls=_cases(call for call, _, _ in limbs),
            after_calls=_cases(call for _, call, _ in limbs),
            copies="\n".join(self._copies()),
        )
        if self._uneven:
            places = [self._place(*numbered) for numbered in enumerate(self._kinds.items())]
            self._fill("place.c", calls=_cases(places))
        return "\n".join(self._text)

    def _fill(self, name: str, **values: object) -> None:
        """Append a hand-written function, a template in this package."""
        file = resources.files("gaitswarm.sim.kernel.emitted") / name
        template = Template(file.read_text(encoding="utf-8"))
        self._text.append(template.substitute(self._tables, **values))

    def _emit(
        self,
        name: str,
        inputs: Mapping[str, _Input],
        s: Mapping[str, Sequence[Scalar]],
        outputs: Mapping[str, Sequence[Scalar]],
        added: str = "",
    ) -> str:
        """Append a function from inputs, with their symbols, to outputs; return its call.

        Outputs are named by their addresses in C; `added` is one that is incremented.
        """
        function = ca.Function(
            "piece",
            [_vertical(s[name]) for name in inputs],
            [_vertical(values) for values in outputs.values()],
            list(inputs),
            ["added" if at == added else f"out{k}" for k, at in enumerate(outputs)],
            {"cse": True},
        )
        self._text.append(
            emit_c(function, name, (_CONSTANTS,), added=("added",), in_place="tallies" in outputs)
        )
        return f"{name}({', '.join([*(x.at for x in inputs.values()), *outputs])});"

    def _copies(self) -> list[str]:
        """C that copies a limb's results into the internal state."""
        n, robot = JOINTS_PER_LEG, self._robot
        copies = [
            (n * robot.has_backlash, self._of_joints(1), "spun"),
            (n * robot.has_dry_friction, self._springs(), "springs"),
            (self._carried, self._contact_state(), "carried"),
        ]
        copy = "    for (int i = 0; i < {}; i++) ({})[i] = {}[i];"
        return [copy.format(*parts) for parts in copies if parts[0]]

    def _p(self, name: str, size: int | None = None) -> _Input:
        where = self._layout.slices[name]
        if size is None:
            return _Input(where.stop - where.start, f"p + {where.start}")
        return _Input(size, f"p + {where.start} + {size} * l")

    def _of_joints(self, number: int) -> str:
        return f"internal + {number * self._n} + {JOINTS_PER_LEG} * l"

    def _springs(self, further: int = 0) -> str:
        """Springs of dry friction in the internal state, and one further the loads."""
        return self._of_joints(2 * self._robot.has_backlash + further)

    def _contact_state(self) -> str:
        start = internal_state_size(self._robot) - self._carried * len(self._robot.legs)
        return f"internal + {start} + {self._carried} * l"

    def _before_limbs(self) -> str:
        n = self._n
        inputs = {
            "q": _Input(7, "q"),
            "v": _Input(6, "v"),
            "duty": _Input(n, "duty"),
            "rates": _Input(n, f"internal + {n}" if self._robot.has_backlash else "v + 6"),
            "source": self._p("supply_voltage"),
            "internal": self._p("supply_resistance"),
            **{
                name: self._p(name)
                for name in ("gravity", "base_mass", "base_moment", "base_inertia")
            },
            _CONSTANTS: _Input(2 * n, "robot"),
        }
        s = _symbols(inputs)
        supply = battery_voltage(
            s[_CONSTANTS],
            s["duty"],
            s["rates"],
            s["source"][0],
            s["internal"][0],
            torque=self._robot.is_torque_controlled,
        )
        state, body = body_state(s["q"], s["v"], s["gravity"]), body_of(s)
        gathered = _passed(body.inertia(), state.force(body))
        outputs = {"body": _varying(state), "gathered": gathered, "&supply": [supply]}
        return self._emit("before_limbs", inputs, s, outputs)

    def _push_body(self) -> str:
        inputs = {"body": self._body, "push": self._p("push")}
        s, force = _symbols(inputs), f"gathered + {_FORCE}"
        push = pushed(_filled(self._any_body, s["body"]), s["push"])
        return self._emit("push_body", inputs, s, {force: push}, added=force)

    def _solve_body(self) -> str:
        inputs = {
            "body": self._body,
            "passed": _Input(_PASSED, "gathered"),
            "timestep": self._p("timestep"),
        }
        s = _symbols(inputs)
        state = _filled(self._any_body, s["body"])
        falling, true = solved(state, *_passed_of(s["passed"]))
        dt = s["timestep"][0]
        faster = [old + dt * rate for old, rate in zip(s["body"][:6], leaves(true), strict=True)]
        of_body = [*body_integrands(state, true, dt), *body_lean(state)]
        outputs = {"falling": list(leaves(falling)), "v": faster, "of_body": of_body}
        return self._emit("solve_body", inputs, s, outputs)

    def _limb(self, number: int, of: tuple[LimbKind, Limb]) -> tuple[str, str, int]:
        """Return calls of a kind's two functions, and the number of values held between them."""
        (kind, limb), n = of, JOINTS_PER_LEG
        moving, dry = n * self._robot.has_backlash, n * self._robot.has_dry_friction
        constants = _Input(len(kind.numbers_of(limb)), "robot + start[l]")
        rates = _Input(n, "v + 6 + 3 * l")
        timestep = self._p("timestep")
        inputs = {
            "body": self._body,
            "supply": _Input(1, "&supply"),
            "angles": _Input(n, "q + 7 + 3 * l"),
            "rates": rates,
            "duty": _Input(n, "duty + 3 * l"),
            "disturbance": _Input(n, "disturbance + 3 * l"),
            "motor_angles": _Input(moving, "internal + 3 * l"),
            "motor_rates": _Input(moving, self._of_joints(1)),
            "springs": _Input(dry, self._springs()),
            "loads": _Input(dry, self._springs(1)),
            "carried": _Input(self._carried, self._contact_state()),
            **({"patch": _Input(3, "patches + 3 * l")} if self._uneven else {}),
            "timestep": timestep,
            "displaced": self._p("displaced"),
            **{name: self._p(name, size) for name, size in self._layout.by_limb.items()},
            _CONSTANTS: constants,
        }
        s = _symbols(inputs)
        result = before(
            kind.symbolic(limb, s[_CONSTANTS]),
            self._law,
            _filled(self._any_body, s["body"]),
            LimbState(**{f.name: s[f.name] for f in fields(LimbState) if f.name in s}),
            Environment(s["timestep"][0], s["supply"][0], *s["displaced"]),
            {name: s[name] for name in self._layout.by_limb},
        )
        cut = _varying(result.held)
        later = {
            "held": _Input(len(cut), "held[l]"),
            "falling": _Input(6, "falling"),
            "rates": rates,
            "timestep": timestep,
            _CONSTANTS: constants,
        }
        t = _symbols(later)
        a, b, c, d, e, f = t["falling"]
        done = after(
            kind.symbolic(limb, t[_CONSTANTS]),
            _filled(result.held, t["held"]),
            Motion((a, b, c), (d, e, f)),
            t["rates"],
            t["timestep"][0],
        )
        outputs = {
            "v + 6 + 3 * l": done.rates,
            "current + 3 * l": done.currents,
            "tallies": done.tallies,
            self._springs(1): done.loads if dry else (),
        }
        # Only part of the held values is read later.
        symbols = (x for o in outputs.values() if o for x in ca.symvar(ca.vertcat(*o)))
        read = {x.element_hash() for x in symbols}
        read_later = [k for k, x in enumerate(t["held"]) if x.element_hash() in read]
        held = {
            "gathered": _passed(result.inertia, result.force),
            "held[l]": [cut[k] for k in read_later],
            "spun": result.motor_rates,
            "springs": result.springs,
            "carried": result.carried,
        }
        first = self._emit(f"before_{number}", inputs, s, held, added="gathered")
        t["held"] = tuple(t["held"][k] for k in read_later)
        return first, self._emit(f"after_{number}", later, t, outputs), len(read_later)

    def _place(self, number: int, of: tuple[LimbKind, Limb]) -> str:
        kind, limb = of
        inputs = {
            "q": _Input(7, "q"),
            "angles": _Input(JOINTS_PER_LEG, "q + 7 + 3 * l"),
            _CONSTANTS: _Input(len(kind.numbers_of(limb)), "robot + start[l]"),
        }
        s = _symbols(inputs)
        placed = place(kind.symbolic(limb, s[_CONSTANTS]), s["q"], s["angles"])
        return self._emit(f"place_{number}", inputs, s, {"places[l]": placed})


def _symbols(inputs: Mapping[str, _Input]) -> dict[str, tuple[Scalar, ...]]:
    vectors = {name: ca.SX.sym(name, piece.size) for name, piece in inputs.items()}
    return {name: tuple(x[k] for k in range(inputs[name].size)) for name, x in vectors.items()}


def _vertical(values: Sequence[Scalar]) -> Any:
    return ca.vertcat(*values) if values else ca.SX(0, 1)


def _cases(calls: Iterable[str]) -> str:
    return "\n".join(f"    case {number}: {call} break;" for number, call in enumerate(calls))


def _varies(leaf: Scalar) -> bool:
    return isinstance(leaf, ca.SX) and not leaf.is_constant()


def _varying(tree: object) -> list[Scalar]:
    """The non-constant numbers of a tree."""
    return [leaf for leaf in leaves(tree) if _varies(leaf)]


def _filled(tree: T, numbers: Sequence[Scalar]) -> T:
    """Replace the non-constant numbers of a tree."""
    left = iter(numbers)
    return mapped(tree, lambda leaf: next(left) if _varies(leaf) else leaf)


def _passed(inertia: Inertia, force: Force) -> list[Scalar]:
    """Numbers of an inertia, of whose symmetric parts the upper triangles, and of a force."""
    return [
        *(inertia.linear[i][j] for i, j in _UPPER),
        *leaves(inertia.coupling),
        *(inertia.angular[i][j] for i, j in _UPPER),
        *leaves(force),
    ]


def _passed_of(numbers: Sequence[Scalar]) -> tuple[Inertia, Force]:
    def symmetric(x: Sequence[Scalar]) -> Any:
        return (x[0], x[1], x[2]), (x[1], x[3], x[4]), (x[2], x[4], x[5])

    def triple(x: Sequence[Scalar]) -> Any:
        return x[0], x[1], x[2]

    coupling = (triple(numbers[6:9]), triple(numbers[9:12]), triple(numbers[12:15]))
    inertia = Inertia(symmetric(numbers[:6]), coupling, symmetric(numbers[15:21]))
    return inertia, Force(triple(numbers[21:24]), triple(numbers[24:27]))
