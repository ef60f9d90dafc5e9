"""Bodies of requests that would hold up, fill or end a server that is not careful: a corpus of 200.

Families: robot.toml and robot.urdf that are deep, long, many, huge, damaged or misnamed; specs that
ask for too much; and bodies that are no documents.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from importlib import resources
from typing import Any, Final

TAKEN: Final = (200, 202)
REFUSED: Final = (422,)

_FOLDER = resources.files("gaitswarm.sim.robot") / "szabadka2"
TOML: Final = (_FOLDER / "robot.toml").read_text(encoding="utf-8")
URDF: Final = (_FOLDER / "robot.urdf").read_text(encoding="utf-8")
END: Final = "</robot>"


@dataclass(frozen=True)
class Body:
    """What is posted where, and what is to come back.

    field: an offending field that the problem names, or one below it; None: not looked at.
    """

    name: str
    content: bytes
    path: str = "/v1/jobs"
    statuses: tuple[int, ...] = REFUSED
    field: str | None = None


@cache
def corpus() -> tuple[Body, ...]:
    """The whole corpus, the same every time."""
    bodies = [*_toml(), *_urdf_sizes(), *_urdf_numbers(), *_urdf_trees(), *_specs(), *_raw()]
    names = [body.name for body in bodies]
    assert len(set(names)) == len(names)
    return tuple(bodies)


def chain(links: int, *, star: bool = False) -> str:
    """The URDF with links that are welded to each other, or all to the body."""
    text = "".join(
        f'<link name="t{k}"/><joint name="w{k}" type="fixed">'
        f'<parent link="{f"t{k - 1}" if k and not star else "body"}"/><child link="t{k}"/></joint>'
        for k in range(links)
    )
    return URDF.replace(END, text + END)


def _spec(**fields: Any) -> bytes:
    return json.dumps({"scenarios": ["1"], "iterations": 1} | fields).encode()


def _of_toml(name: str, toml: str, statuses: tuple[int, ...] = REFUSED) -> Body:
    robot = {"toml": toml, "urdf": URDF}
    field = "robot" if statuses == REFUSED else None
    return Body(f"toml {name}", _spec(robot=robot), statuses=statuses, field=field)


def _of_urdf(name: str, urdf: str, statuses: tuple[int, ...] = REFUSED) -> Body:
    robot = {"toml": TOML, "urdf": urdf}
    field = "robot" if statuses == REFUSED else None
    return Body(f"urdf {name}", _spec(robot=robot), statuses=statuses, field=field)


def _toml() -> Iterator[Body]:
    for n in (17, 1000, 90_000):
        key = ".".join("a" * n)
        yield _of_toml(f"dotted key of {n}", f"{TOML}\n{key} = 1")
        yield _of_toml(f"dotted table of {n}", f"{TOML}\n[{key}]")
        yield _of_toml(f"quoted key of {n}", TOML + "\n" + ".".join(['"a"'] * (n // 2 + 9)) + "=1")
        yield _of_toml(f"arrays of {n}", f"x = {'[' * n}{']' * n}\n{TOML}")
        yield _of_toml(f"inline tables of {n}", f"x = {'{a=' * (n // 2)}1{'}' * (n // 2)}\n{TOML}")
        yield _of_toml(f"values of {n}", f"x = [{'1,' * n}]\n{TOML}")
        yield _of_toml(f"tables of {n // 6}", TOML + "".join(f"\n[a{k}]" for k in range(n // 6)))
    for quote in ('"""', "'''"):
        yield _of_toml(f"arrays behind {quote}", f"x = {quote}a{quote}{quote[0]} , {'[' * 90_000}")
        yield _of_toml(f"open {quote}", f"{TOML}\nx = {quote}" + f"\\{quote}" * 40_000)
    for name, line in (
        ("bracket", "[" + " " * 100_000),
        ("word", "x" + " " * 100_000),
        ("brackets", "[a" * 50_000),
        ("quotes", "\"'." * 30_000),
    ):
        yield _of_toml(f"line of {name}", f"x = '''\n{line}\n'''\n{TOML}".replace("'.", "."))
    numbers = ("nan", "inf", "-inf", "-1.0", "0.0", "1e300", "1e-300", "9" * 400, "1979-05-27")
    for number in (*numbers, "1" * 150_000, "0x" + "f" * 150_000, "true", '"4.09"', "[4.09]"):
        changed = TOML.replace("resistance = 4.09", f"resistance = {number}", 1)
        statuses = TAKEN if number in ("true", '"4.09"') else REFUSED
        yield _of_toml(f"resistance {number[:12]}", changed, statuses)
    for number in ("1" * 30, "-1", "0", "1.5"):
        changed = TOML.replace("counts = 511", f"counts = 511\nstep = {number}", 1)
        yield _of_toml(f"step {number[:12]}", changed)
    for name in ("../../etc/passwd", "a\\u0000b", "a\\u202eb", "a" * 101, "", "a\\nb"):
        changed = TOML.replace('name = "right_front"', f'name = "{name}"', 1)
        yield _of_toml(f"leg {name[:20]}", changed)
    for name in ("../../etc/passwd", "机器人 🤖", "<script>", "%s%n", "' or 1=1 --"):
        yield _of_toml(f"named {name}", TOML.replace('"szabadka2"', f'"{name}"', 1), TAKEN)
    leg = TOML[TOML.rindex("[[legs]]") :]
    yield _of_toml("leg twice", TOML + leg)
    yield _of_toml("33 legs", TOML + leg * 27)
    yield _of_toml("2000 legs", TOML + leg * 2000)
    yield _of_toml("no legs", TOML[: TOML.index("[[legs]]")])
    yield _of_toml("key twice", TOML + "\nname = 1\nname = 2")
    yield _of_toml("long key", f"{TOML}\n{'k' * 150_000} = 1")
    yield _of_toml("empty", "")
    yield _of_toml("blank lines", TOML + "\n" * 150_000, TAKEN)
    yield _of_toml("blanks", TOML + " " * 150_000, TAKEN)
    yield _of_toml("comment", TOML + "#" * 150_000, TAKEN)
    yield _of_toml("comments", TOML + "\n#[" * 60_000, TAKEN)
    yield _of_toml("too long", TOML + "#" * 200_000)
    yield _of_toml("zeros", "\0" * 1000)
    yield _of_toml("no character", TOML + "# \ud800")


def _urdf_sizes() -> Iterator[Body]:
    for n in (300, 1000, 4500):
        yield _of_urdf(f"chain of {n}", chain(n))
        yield _of_urdf(f"star of {n}", chain(n, star=True))
    yield _of_urdf("chain of 200", chain(200), TAKEN)
    for path, extra in (("estimates", {}), ("simulations", {}), ("replays", {"scenario": "1"})):
        robot = {"robot": {"toml": TOML, "urdf": chain(4500)}, **extra}
        walk: dict[str, Any] = {"controller": "pi", "design": {"P": 0.45, "I": 0.1}}
        body = json.dumps(robot if path == "estimates" else walk | robot).encode()
        yield Body(f"chain of 4500 in {path}", body, f"/v1/{path}", field="robot")
    for n in (17, 1000, 100_000):
        yield _of_urdf(f"depth {n}", URDF.replace(END, "<a>" * n + "</a>" * n + END))
        yield _of_urdf(f"unclosed {n}", URDF.replace(END, "<a>" * n))
    for n in (10_000, 150_000):
        yield _of_urdf(f"elements {n}", URDF.replace(END, "<a/>" * n + END))
    for name, text in (
        ("comment", f"<!--{'x' * 700_000}-->"),
        ("comments", "<!--x-->" * 80_000),
        ("text", "x" * 700_000),
        ("sections", "<![CDATA[x]]>" * 50_000),
        ("references", "&#65;" * 100_000),
    ):
        yield _of_urdf(name, URDF.replace(END, text + END), TAKEN)
    yield _of_urdf("instructions", URDF.replace(END, "<?a b?>" * 80_000 + END))
    attributes = " ".join(f"a{k}=''" for k in range(50_000))
    yield _of_urdf("attributes", URDF.replace(END, f"<a {attributes}/>{END}"))
    yield _of_urdf("attribute twice", URDF.replace(END, f"<a {'a=' + repr('') + ' '} a=''/>{END}"))
    yield _of_urdf("unknown entity", URDF.replace(END, "&a;" + END))
    ten = "".join(f'<!ENTITY e{k} "{f"&e{k - 1};" * 10}">' for k in range(1, 20))
    for name, entities in (
        ("laughs", f'<!ENTITY e0 "ha">{ten}'),
        ("blow-up", f'<!ENTITY e19 "{"x" * 300_000}">'),
        ("file", '<!ENTITY e19 SYSTEM "file:///etc/passwd">'),
        ("network", '<!ENTITY e19 SYSTEM "http://127.0.0.1:1/">'),
        ("parameter", '<!ENTITY % e SYSTEM "file:///dev/zero"> %e;'),
        ("itself", '<!ENTITY e19 "&e19;">'),
        ("none", ""),
    ):
        document = f"<!DOCTYPE robot [{entities}]>{URDF.replace(END, '&e19;' * 50 + END)}"
        yield _of_urdf(f"entity {name}", document.replace('<?xml version="1.0"?>', ""))


def _urdf_numbers() -> Iterator[Body]:
    numbers = ("nan", "inf", "-inf", "1e400", "1e99", "-1", "0x10", "much", "", "1 2", "9" * 900_00)
    for number in numbers:
        changed = URDF.replace('<mass value="', f'<mass value="{number}" was="', 1)
        yield _of_urdf(f"mass {number[:10]}", changed)
    for vector in ("nan 0 0", "1e300 0 0", "0 0", "0 " * 100_000, "0,0,0"):
        changed = URDF.replace('xyz="', f'xyz="{vector}" was="', 1)
        yield _of_urdf(f"origin {vector[:10]}", changed)


def _urdf_trees() -> Iterator[Body]:
    weld = '<joint name="{}" type="fixed"><parent link="{}"/><child link="{}"/></joint>'
    spare = '<link name="spare"/>'
    for name, text in (
        ("joint to itself", spare + weld.format("w", "spare", "spare")),
        (
            "circle",
            '<link name="a"/><link name="b"/>'
            + "".join(weld.format(*joint) for joint in (("u", "a", "b"), ("v", "b", "a"))),
        ),
        ("two parents", weld.format("w", "right_front_coxa_link", "left_front_coxa_link")),
        ("no such link", weld.format("w", "body", "moon")),
        ("no ends", '<joint name="w" type="fixed"/>'),
        ("second body", spare),
        ("many bodies", "".join(f'<link name="s{k}"/>' for k in range(200))),
        ("link twice", '<link name="body"/>'),
        ("motor of no leg", spare + weld.format("w", "body", "spare").replace("fixed", "revolute")),
        ("unknown joint", spare + weld.format("w", "body", "spare").replace("fixed", "magic")),
        (
            "bare inertia",
            '<link name="spare"><inertial/></link>' + weld.format("w", "body", "spare"),
        ),
    ):
        yield _of_urdf(name, URDF.replace(END, text + END))
    for name in ("a" * 101, "a&#x202e;b", "a&#xd800;b", "a&#0;b"):
        yield _of_urdf(f"name {name[:10]}", URDF.replace('name="body"', f'name="{name}"', 1))
    slashed = '<link name="../../etc/passwd"/>' + weld.format("w", "body", "../../etc/passwd")
    yield _of_urdf("path", URDF.replace(END, slashed + END), TAKEN)
    for kind in ("prismatic", "floating", "planar"):
        yield _of_urdf(f"joints {kind}", URDF.replace('"revolute"', f'"{kind}"'))
    yield _of_urdf("no axis", URDF.replace('<axis xyz="', '<axis xyz="0 0 0" was="'))
    yield _of_urdf("no lengths", URDF.replace('<origin xyz="', '<origin xyz="0 0 0" was="'))
    for name, text in (("empty", ""), ("no robot", "<a/>"), ("json", "{}"), ("zeros", "\0" * 99)):
        yield _of_urdf(name, text)
    yield _of_urdf("too long", URDF + " " * 800_000)
    yield _of_urdf("no character", URDF + "\ud800")


def _own(**fields: Any) -> dict[str, Any]:
    return {"name": "own", "cycle_time": 1.5, "radius": 0.16, "hip_height": 0.15} | fields


def _specs() -> Iterator[Body]:
    def spec(
        title: str, field: str | None, statuses: tuple[int, ...] = REFUSED, /, **fields: Any
    ) -> Body:
        return Body(f"spec {title}", _spec(**fields), statuses=statuses, field=field)

    long = {"cycle_time": 10.0, "cycles": 100.0, "fir_ms": 1000, "fir_window": "hamming"}
    longest = [_own(name=f"s{k}", **long) for k in range(32)]
    yield spec("longest walks", None, TAKEN, scenarios=longest)
    far = [_own(name=f"s{k}", stride=0.9, **long) for k in range(32)]
    yield spec("longest walks out of reach", "scenarios", scenarios=far)
    yield spec("longest job", "iterations", scenarios=longest, iterations=1_000_000)
    worlds = {"count": 100}
    many = {"name": "pso", "particles": 10_000}
    yield spec("most walks", "optimizer", scenarios=longest, worlds=worlds, optimizer=many)
    yield spec("33 scenarios", "scenarios", scenarios=[_own(name=f"s{k}") for k in range(33)])
    yield spec("10000 scenarios", "scenarios", scenarios=["1"] * 10_000)
    yield spec("100000 variables", "variables", variables=["FI1R"] * 100_000)
    yield spec("10000 fixed", "fixed", fixed={f"v{k}": 1.0 for k in range(10_000)})
    yield spec("50000 fixed without a name", "fixed", fixed={f"{k}": 1.0 for k in range(50_000)})
    starts = [{"FI1R": float(k)} for k in range(20_000)]
    yield spec("20000 starts", "start", start=starts)
    yield spec("9000 starts", "start", start=starts[:9000], iterations=1000)
    fields = {f"{k}": 1 for k in range(70_000)}
    yield spec("70000 fields", None, **fields)
    yield spec("70000 fields of a scenario", "scenarios", scenarios=[_own(**fields)])
    yield spec("70000 fields of a start", "start", start=[fields])
    yield spec("70000 fields of starts", "start", start=fields)
    names = [{f"{i}": 1 for i in range(9)}] * 9000
    yield spec("9000 starts without a name", "start", start=names, iterations=1000)
    yield Body(
        "spec recording of 120000 words",
        json.dumps({"current": [["a", "b"]] * 60_000}).encode(),
        "/v1/recordings",
        field="current",
    )
    yield spec("long key", None, **{"k" * 900_000: 1})
    yield spec("long name", "name", name="n" * 900_000)
    yield spec("long scenario", "scenarios", scenarios=["s" * 900_000])
    for name, value in (
        ("digits", 10**4000), ("float", 1e308), ("negative", -(2**70)), ("text", "x" * 1000)
    ):  # fmt: skip
        yield spec(f"seed {name}", "seed", seed=value)
        yield spec(f"iterations {name}", "iterations", iterations=value)
        yield spec(f"cycle time {name}", "scenarios", scenarios=[_own(cycle_time=value)])
        yield spec(f"fixed {name}", "fixed", fixed={"FI1R": value})
    for name in ("../../up", "a\0b", "a\u202eb", "", "ü", "x" * 61):
        yield spec(f"scenario named {name[:9]!r}", "scenarios", scenarios=[_own(name=name)])
    sources: tuple[Any, ...] = (
        [],
        7,
        {},
        {"toml": 1, "urdf": 2},
        {"toml": TOML},
        {"name": "../szabadka2"},
    )
    for robot in sources:
        expected = TAKEN if robot == {} else REFUSED
        field = None if robot == {} else "robot"
        yield spec(f"robot {json.dumps(robot)[:12]}", field, expected, robot=robot)
    robots = [{"toml": f"# {k}\n{TOML}", "urdf": URDF} for k in range(40)]
    yield spec("40 robots", "robots", kind="calibration", robots=robots)
    nested: Any = {"toml": "", "urdf": ""}
    for _ in range(200):
        nested = {"robot": [nested]}
    yield spec("robot far below", None, robot=nested)
    certificate = {"kind": "certificate", "design": {"P": 0.4, "I": 0.1}, "controller": "pi"}
    yield spec("worlds without number", None, **certificate, iterations=10**9)


def _raw() -> Iterator[Body]:
    def raw(name: str, content: bytes, *statuses: int) -> Body:
        return Body(f"raw {name}", content, statuses=statuses or (400,))

    for n in (500, 5000, 500_000):
        yield raw(f"arrays {n}", b"[" * n + b"]" * n, 400, 422)
        yield raw(f"objects {n}", b'{"robot":' * n + b"1" + b"}" * n, 400, 413, 422)
    yield raw("digits", b'{"seed": ' + b"1" * 100_000 + b"}", 400, 422)
    yield raw("no UTF-8", b'{"name": "\xff\xfe"}')
    yield raw("UTF-16", '{"name": "x"}'.encode("utf-16"), 400, 422, 202)
    yield raw("zeros", b"\0" * 100_000)
    yield raw("blanks", b" " * 1_000_000)
    yield raw("cut off", _spec(robot={"toml": TOML, "urdf": URDF})[:-100])
    yield raw("keys twice", b"{" + b'"seed": 1, ' * 80_000 + b'"seed": 2}')
    comment = chain(0).replace(END, f"<!--{'x' * 2_000_000}-->{END}")
    yield raw("2 MB comment", _spec(robot={"toml": TOML, "urdf": comment}), 413)
