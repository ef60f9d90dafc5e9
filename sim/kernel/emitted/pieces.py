"""A physics step in pieces: C functions of the body and of each kind of limb, called in a loop"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from typing import Any, Final

import casadi as ca
import numpy as np

from gaitswarm.sim.kernel.dynamics.articulated_body import (
    LinkState,
    body_integrands,
    body_lean,
    body_of,
    body_state,
    pushed,
    solved,
)
from gaitswarm.sim.kernel.dynamics.drives import battery_voltage
from gaitswarm.sim.kernel.dynamics.kinds import LimbKind, limb_kinds
from gaitswarm.sim.kernel.dynamics.limb import Environment, Held, LimbState, after, before, place
from gaitswarm.sim.kernel.dynamics.spatial import Force, Inertia, Motion, Scalar, leaves, mapped
from gaitswarm.sim.kernel.emitted.emit_c import emit_c
from gaitswarm.sim.kernel.parameters import CONTACT_LAWS, Layout, internal_state_size
from gaitswarm.sim.robot.description import JOINTS_PER_LEG
from gaitswarm.sim.robot.limbs import Limb, limbs_of
from gaitswarm.sim.robot.robot import Robot

_PASSED: Final = 27
"""Numbers that a limb passes to the body: an inertia (6 + 9 + 6) and a force (6)."""

_FORCE: Final = 21
"""Index of the force among them."""

_N_TALLIES: Final = 10

_CONSTANTS: Final = "constants"
"""Name of the input shared by all walks."""


def kernel_pieces(robot: Robot, *, uneven: bool = False) -> str:
    """C source of `kick` for a robot, on uneven ground also of `place_feet`."""
    return _Pieces(robot, uneven=uneven).text()


@dataclass(frozen=True, slots=True)
class _Input:
    """An input of a piece: its length and its address in C."""

    size: int
    at: str


class _Pieces:
    def __init__(self, robot: Robot, *, uneven: bool) -> None:
        self._robot, self._uneven = robot, uneven
        self._n = robot.n_joints
        self._layout = Layout(robot)
        self._limbs = limbs_of(robot)
        self._kinds = limb_kinds(self._limbs)
        self._law = robot.description.contact_law
        self._held = 0
        self._text: list[str] = []

    def text(self) -> str:
        before_body = self._emit(
            "before_limbs", self._before_limbs(), ["body", "gathered", "&supply"]
        )
        push = self._emit("push_body", self._push_body(), [f"gathered + {_FORCE}"])
        solve = self._emit("solve_body", self._solve_body(), ["falling", "v", "of_body"])
        limb_calls = self._limb_pieces()
        counts = [len(kind.numbers_of(limb)) for limb, kind in self._by_limb()]
        starts = np.concatenate([[2 * self._n], 2 * self._n + np.cumsum(counts)]).tolist()
        return "\n".join(
            [
                f"#define SERVOS {starts[-1]}",
                f"#define NR {starts[-1] + 4 * self._n * (self._robot.servos is not None)}",
                *self._text,
                _KICK.format(
                    limbs=len(self._limbs),
                    held=self._held,
                    joints=JOINTS_PER_LEG,
                    starts=", ".join(map(str, starts[:-1])),
                    kinds=", ".join(str(self._distinct.index(kind)) for kind in self._kinds),
                    before_limbs=before_body,
                    push_body=push,
                    solve_body=solve,
                    body=len(_body_numbers()),
                    passed=_PASSED,
                    tallies=_N_TALLIES,
                    before_calls="\n".join(call for call, _ in limb_calls),
                    after_calls="\n".join(call for _, call in limb_calls),
                    copies="\n".join(self._copies()),
                ),
                *([self._place_feet(starts[:-1])] if self._uneven else []),
            ]
        )

    def _copies(self) -> list[str]:
        """C that copies a limb's results into the internal state."""
        copy = "    for (int i = 0; i < {size}; i++) ({at})[i] = {of}[i];"
        size, copies = CONTACT_LAWS[self._law].internal_state_size, []
        if self._robot.has_backlash:
            copies.append(copy.format(size=JOINTS_PER_LEG, at=self._of_joints(1), of="spun"))
        if self._robot.has_dry_friction:
            copies.append(copy.format(size=JOINTS_PER_LEG, at=self._springs(), of="springs"))
        if size:
            copies.append(copy.format(size=size, at=self._carried("internal"), of="carried"))
        return copies

    @property
    def _distinct(self) -> list[LimbKind]:
        return list(dict.fromkeys(self._kinds))

    def _place_feet(self, starts: Sequence[int]) -> str:
        calls, n = [], JOINTS_PER_LEG
        text, self._text = self._text, []
        for number, kind in enumerate(self._distinct):
            limb = next(limb for limb, kind_of_limb in self._by_limb() if kind_of_limb == kind)
            inputs = {
                "q": _Input(7, "q"),
                "angles": _Input(n, "q + 7 + 3 * l"),
                _CONSTANTS: _Input(len(kind.numbers_of(limb)), "robot + start[l]"),
            }
            symbols, s = _symbols(inputs)
            placed = place(kind.symbolic(limb, s[_CONSTANTS]), s["q"], s["angles"])
            call = self._emit(
                f"place_{number}", self._function(inputs, [placed], symbols), ["places[l]"]
            )
            calls.append(f"    case {number}: {call} break;")
        functions, self._text = self._text, text
        return "\n".join(
            [
                *functions,
                _PLACE.format(
                    limbs=len(self._limbs),
                    starts=", ".join(map(str, starts)),
                    kinds=", ".join(str(self._distinct.index(kind)) for kind in self._kinds),
                    calls="\n".join(calls),
                ),
            ]
        )

    def _by_limb(self) -> list[tuple[Limb, LimbKind]]:
        return list(zip(self._limbs, self._kinds, strict=True))

    def _limb_pieces(self) -> list[tuple[str, str]]:
        calls = []
        for number, kind in enumerate(self._distinct):
            limb = next(limb for limb, kind_of_limb in self._by_limb() if kind_of_limb == kind)
            first, second, held = self._limb_functions(limb, kind)
            self._held = max(self._held, held)
            a = self._emit(
                f"before_{number}", first, ["gathered", "held[l]", "spun", "springs", "carried"]
            )
            results = ["v + 6 + 3 * l", "current + 3 * l", "tallies", self._springs(1)]
            b = self._emit(f"after_{number}", second, results)
            calls.append((f"    case {number}: {a} break;", f"    case {number}: {b} break;"))
        return calls

    def _emit(self, name: str, piece: tuple[Any, Sequence[str]], outputs: Sequence[str]) -> str:
        """Append a function's text; return its call."""
        function, arguments = piece
        self._text.append(
            emit_c(function, name, (_CONSTANTS,), added=("added",), in_place="tallies" in outputs)
        )
        return f"{name}({', '.join([*arguments, *outputs])});"

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

    def _carried(self, internal: str) -> str:
        size = CONTACT_LAWS[self._law].internal_state_size
        start = internal_state_size(self._robot) - size * len(self._limbs)
        return f"{internal} + {start} + {size} * l"

    def _function(
        self,
        inputs: Mapping[str, _Input],
        outputs: Sequence[Sequence[Scalar]],
        symbols: Any,
        added: int | None = None,
    ) -> tuple[Any, list[str]]:
        """Return a function and its arguments in C. The output `added` is an increment."""
        vectors = [ca.vertcat(*o) if o else ca.SX(0, 1) for o in outputs]
        names = list(inputs)
        outs = ["added" if k == added else f"out{k}" for k in range(len(vectors))]
        function = ca.Function(
            "piece", [symbols[name] for name in names], vectors, names, outs, {"cse": True}
        )
        return function, [inputs[name].at for name in names]

    def _before_limbs(self) -> tuple[Any, list[str]]:
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
        symbols, s = _symbols(inputs)
        supply = battery_voltage(
            s[_CONSTANTS],
            s["duty"],
            s["rates"],
            s["source"][0],
            s["internal"][0],
            torque=self._robot.is_torque_controlled,
        )
        state, body = body_state(s["q"], s["v"], s["gravity"]), body_of(s)
        numbers = [leaf for leaf in leaves(state) if _varies(leaf)]
        gathered = [*_triangles(body.inertia()), *leaves(state.force(body))]
        return self._function(inputs, [numbers, gathered, [supply]], symbols)

    def _push_body(self) -> tuple[Any, list[str]]:
        inputs = {"body": _Input(len(_body_numbers()), "body"), "push": self._p("push")}
        symbols, s = _symbols(inputs)
        return self._function(inputs, [pushed(_body_of(s["body"]), s["push"])], symbols, added=0)

    def _solve_body(self) -> tuple[Any, list[str]]:
        inputs = {
            "body": _Input(len(_body_numbers()), "body"),
            "passed": _Input(_PASSED, "gathered"),
            "timestep": self._p("timestep"),
        }
        symbols, s = _symbols(inputs)
        state = _body_of(s["body"])
        inertia, force = _passed_of(s["passed"])
        falling, true = solved(state, inertia, force)
        dt = s["timestep"][0]
        faster = [old + dt * rate for old, rate in zip(s["body"][:6], leaves(true), strict=True)]
        outputs = [
            list(leaves(falling)),
            faster,
            [*body_integrands(state, true, dt), *body_lean(state)],
        ]
        return self._function(inputs, outputs, symbols)

    def _limb_functions(self, limb: Limb, kind: LimbKind) -> tuple[Any, Any, int]:
        """Return both functions of a kind of limb, and the number of values held between them."""
        n, backlash = JOINTS_PER_LEG, self._robot.has_backlash
        moving, dry = n if backlash else 0, n if self._robot.has_dry_friction else 0
        constants = _Input(len(kind.numbers_of(limb)), "robot + start[l]")
        rates = _Input(n, "v + 6 + 3 * l")
        timestep = self._p("timestep")
        inputs = {
            "body": _Input(len(_body_numbers()), "body"),
            "supply": _Input(1, "&supply"),
            "angles": _Input(n, "q + 7 + 3 * l"),
            "rates": rates,
            "duty": _Input(n, "duty + 3 * l"),
            "disturbance": _Input(n, "disturbance + 3 * l"),
            "motor_angles": _Input(moving, "internal + 3 * l"),
            "motor_rates": _Input(moving, self._of_joints(1)),
            "springs": _Input(dry, self._springs()),
            "loads": _Input(dry, self._springs(1)),
            "carried": _Input(
                CONTACT_LAWS[self._law].internal_state_size, self._carried("internal")
            ),
            **({"patch": _Input(3, "patches + 3 * l")} if self._uneven else {}),
            "timestep": timestep,
            "displaced": self._p("displaced"),
            **{name: self._p(name, size) for name, size in self._layout.by_limb.items()},
            _CONSTANTS: constants,
        }
        symbols, s = _symbols(inputs)
        symbolic = kind.symbolic(limb, s[_CONSTANTS])
        result = before(
            symbolic,
            self._law,
            _body_of(s["body"]),
            LimbState(**{f.name: s[f.name] for f in fields(LimbState) if f.name in s}),
            Environment(s["timestep"][0], s["supply"][0], *s["displaced"]),
            {name: s[name] for name in self._layout.by_limb},
        )
        cut = [leaf for leaf in leaves(result.held) if _varies(leaf)]
        later = {
            "held": _Input(len(cut), "held[l]"),
            "falling": _Input(6, "falling"),
            "rates": rates,
            "timestep": timestep,
            _CONSTANTS: constants,
        }
        symbols_later, s = _symbols(later)
        left = iter(s["held"])
        held: Held = mapped(result.held, lambda leaf: next(left) if _varies(leaf) else leaf)
        linear, angular = s["falling"][:3], s["falling"][3:]
        done = after(
            kind.symbolic(limb, s[_CONSTANTS]),
            held,
            Motion((linear[0], linear[1], linear[2]), (angular[0], angular[1], angular[2])),
            s["rates"],
            s["timestep"][0],
        )
        loads = done.loads if dry else ()
        outputs: list[Sequence[Scalar]] = [done.rates, done.currents, done.tallies, loads]
        # Only part of the held values is read later.
        read = {x.element_hash() for o in outputs if o for x in ca.symvar(ca.vertcat(*o))}
        read_later = [k for k, x in enumerate(s["held"]) if x.element_hash() in read]
        symbols_later["held"] = ca.vertcat(*(s["held"][k] for k in read_later))
        second = self._function(later, outputs, symbols_later)
        passed = [*_triangles(result.inertia), *leaves(result.force)]
        before_body: list[Sequence[Scalar]] = [
            passed,
            [cut[k] for k in read_later],
            result.motor_rates,
            result.springs,
            result.carried,
        ]
        return self._function(inputs, before_body, symbols, added=0), second, len(read_later)


def _symbols(inputs: Mapping[str, _Input]) -> tuple[dict[str, Any], dict[str, tuple[Scalar, ...]]]:
    symbols = {name: ca.SX.sym(name, piece.size) for name, piece in inputs.items()}
    return symbols, {
        name: tuple(x[k] for k in range(inputs[name].size)) for name, x in symbols.items()
    }


def _varies(leaf: Scalar) -> bool:
    return isinstance(leaf, ca.SX) and not leaf.is_constant()


def _any_body() -> LinkState:
    q, v, gravity = (ca.SX.sym("any", size) for size in (7, 6, 3))
    return body_state(*([x[k] for k in range(x.numel())] for x in (q, v, gravity)))


def _body_numbers() -> list[Scalar]:
    """The non-constant numbers of the body's state."""
    return [leaf for leaf in leaves(_any_body()) if _varies(leaf)]


def _body_of(numbers: Sequence[Scalar]) -> LinkState:
    left = iter(numbers)
    return mapped(_any_body(), lambda leaf: next(left) if _varies(leaf) else leaf)


def _triangles(inertia: Inertia) -> list[Scalar]:
    """Numbers of an inertia; upper triangles of its symmetric parts."""
    upper = [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)]
    return [
        *(inertia.linear[i][j] for i, j in upper),
        *leaves(inertia.coupling),
        *(inertia.angular[i][j] for i, j in upper),
    ]


def _passed_of(numbers: Sequence[Scalar]) -> tuple[Inertia, Force]:
    def symmetric(x: Sequence[Scalar]) -> Any:
        return (x[0], x[1], x[2]), (x[1], x[3], x[4]), (x[2], x[4], x[5])

    def triple(x: Sequence[Scalar]) -> Any:
        return x[0], x[1], x[2]

    coupling = (triple(numbers[6:9]), triple(numbers[9:12]), triple(numbers[12:15]))
    inertia = Inertia(symmetric(numbers[:6]), coupling, symmetric(numbers[15:21]))
    return inertia, Force(triple(numbers[21:24]), triple(numbers[24:27]))


_KICK: Final = """\
/* Advances velocities by a step at fixed positions; currents and integrands are those of its
   middle, which also raises peaks and, by leg, the heights to which soles were lifted. landing: 1
   if a foot may touch down within a control tick. shoved: whether any walk's body may be pushed.
   patches: uneven ground below the feet. */
static void kick(const vec *q, vec *v, vec *internal, const vec *duty, const vec *disturbance,
                 const vec *p, const double *robot, const vec *patches, int shoved, vec *current,
                 vec *integrands, vec *peaks, vec *lifted, vec *landing)
{{
  static const int start[{limbs}] = {{ {starts} }}, kind[{limbs}] = {{ {kinds} }};
  vec body[{body}], supply, held[{limbs}][{held}], gathered[{passed}];
  vec spun[{joints}], springs[{joints}], carried[4], falling[6], of_body[5], tallies[{tallies}];
  vec total[6];
  (void)patches;
  {before_limbs}
  if (shoved) {{
    {push_body}
  }}
  for (int l = 0; l < {limbs}; l++) {{
    switch (kind[l]) {{
{before_calls}
    }}
{copies}
  }}
  {solve_body}
  *landing = SPLAT(0.0);
  for (int l = 0; l < {limbs}; l++) {{
    switch (kind[l]) {{
{after_calls}
    }}
    for (int i = 0; i < 6; i++) total[i] = l ? total[i] + tallies[i] : tallies[i];
    for (int i = 0; i < 2; i++) peaks[i] = vec_max(peaks[i], tallies[6 + i]);
    *landing = vec_max(*landing, tallies[8]);
    lifted[l] = vec_max(lifted[l], tallies[9]);
  }}
  integrands[0] = total[0] * total[0];
  integrands[1] = of_body[0];
  integrands[2] = of_body[1];
  integrands[3] = total[1];
  integrands[4] = of_body[2];
  for (int i = 2; i < 6; i++) integrands[3 + i] = total[i];
  for (int i = 2; i < 4; i++) peaks[i] = vec_max(peaks[i], of_body[1 + i]);
}}
"""

_PLACE: Final = """\
/* Feet, then knees in the world, x, y, z each [m]. */
static void place_feet(const vec *q, const double *robot, vec (*places)[6])
{{
  static const int start[{limbs}] = {{ {starts} }}, kind[{limbs}] = {{ {kinds} }};
  for (int l = 0; l < {limbs}; l++) {{
    switch (kind[l]) {{
{calls}
    }}
  }}
}}
"""
