"""Draw docs/images/walks.svg, a moving picture of two walks: python -m scripts.walks

The lower walk alone, without words and colours, is web/src/jobs/walk.svg, which the page shows
as long as there are no jobs.

Above, the optimum that the thesis published under preference A; below, the controller and gait that
the second job of `make demo` finds. Both in the scenario normal-fast, seen from the side and a
little from above; the ground passes as fast as the robot walks.
"""

from __future__ import annotations

import math
import re
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

import gaitswarm
from gaitswarm.replay import ReplayHeaderView, ReplayRequest, run_replay

PICTURE: Final = Path(__file__).parents[1] / "docs" / "images" / "walks.svg"

WALK: Final = Path(__file__).parents[1] / "web" / "src" / "jobs" / "walk.svg"

_CONSTRAINT: Final = {"quantity": "*", "relative_to": "published:A", "max": 1.0}
"""No objective may be worse than that of the published optimum, in any scenario."""

_SCENARIO: Final = "normal-fast"
_RATE: Final = 20.0
_FROM, _TO = 1.5, 4.5
"""Part of the walk that is shown, after it has begun [s]."""

_WIDTH, _ROW, _LEFT, _SCALE = 860, 210, 262, 900.0
"""Of the picture and of one walk in it, left end of the ground [px], and of a metre [px]."""

_MARK: Final = 0.05
"""Between marks on the ground [m]."""

_STRIP: Final = 0.2
"""Half the width of the ground that is drawn [m]."""

_STYLE: Final = """
text { font: 15px system-ui, sans-serif; fill: #22313a }
.number { font-weight: 600 }
.leg, .far { fill: none; stroke-width: 5; stroke-linecap: round; stroke-linejoin: round }
.far { opacity: .45 }
.body { stroke-width: 2; fill-opacity: .25; stroke-linejoin: round }
.published { stroke: #b8590f; fill: #b8590f }
.found { stroke: #0b7285; fill: #0b7285 }
.leg, .far { fill: none }
.ground { stroke: #9aa7ae; stroke-width: 1.5; stroke-opacity: .6 }
@media (prefers-color-scheme: dark) { text { fill: #dde5e9 } }
"""

Points = NDArray[np.float64]


def main() -> None:
    """Run the job, let both designs walk, and write the picture."""
    published = gaitswarm.CONTROLLERS["fuzzy-pi"].published["A"]
    with tempfile.TemporaryDirectory() as folder:
        database = str(Path(folder, "jobs.db"))
        spec = gaitswarm.JobSpec.model_validate(
            {"preference": "A", "iterations": 25, "seed": 1, "constraints": [_CONSTRAINT]}
        )
        run = gaitswarm.optimize(spec.with_gait_searched(), db=database)
    walks = {
        "published": ("published optimum A", published),
        "found": ("found in 625 designs", run.best.design),
    }
    rows = [_row(design, name, words, k) for k, (name, (words, design)) in enumerate(walks.items())]
    height = 2 * _ROW
    PICTURE.write_text(
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {_WIDTH} {height}"'
        f' role="img" aria-label="Two walks of Szabad(ka)-II">\n'
        f"<style>{_STYLE}</style>\n{''.join(rows)}</svg>\n",
        encoding="utf-8",
    )
    WALK.write_text(walk_alone(PICTURE.read_text(encoding="utf-8")), encoding="utf-8")


def walk_alone(picture: str) -> str:
    """The second walk of the picture, cut to the robot and its ground."""
    second = picture[picture.rindex("<g transform=") :]
    moving = re.sub(r"<text.*?</text>\n|<g transform[^>]*>\n", "", second).replace(
        "</g>\n</svg>", "</svg>"
    )
    box = f"{_LEFT} 0 {_WIDTH - _LEFT} {_ROW}"
    return f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="{box}">\n{moving}'


def _replay(design: Mapping[str, float | str]) -> tuple[ReplayHeaderView, dict[str, Points]]:
    """The header of a replay, and its channels (F, ...) by name."""
    request = ReplayRequest(design=dict(design), scenario=_SCENARIO, rate=_RATE)
    content = run_replay(request)
    end = 4 + int.from_bytes(content[:4], "little")
    header = ReplayHeaderView.model_validate_json(content[4:end])
    frames = np.frombuffer(content, "<f4", offset=end).reshape(header.frames, -1).astype(np.float64)
    channels = {
        channel.name: frames[:, channel.offset :][:, : math.prod(channel.shape)].reshape(
            header.frames, *channel.shape
        )
        for channel in header.channels
    }
    return header, channels


def _row(design: Mapping[str, float | str], name: str, words: str, k: int) -> str:
    """A walk as a group: numbers, ground, body and legs."""
    all_six = gaitswarm.simulate(design)
    header, channels = _replay(design)
    time = channels["time"].reshape(-1)
    shown = (time >= _FROM) & (time < _TO)
    poses = channels["link_pose"][shown].astype(float)
    feet = channels["foot_position"][shown].astype(float)
    names = [link.name for link in header.robot.links]
    moved = poses[:, 0, 0]
    seconds = len(moved) / _RATE

    def seen(points: Points) -> Points:
        """(F, N, 3) positions in the world to (F, N, 2) in the picture."""
        return _screen(points - [1.0, 0.0, 0.0] * moved[:, None, None])

    legs = {}
    for j, leg in enumerate(header.robot.legs):
        chain = [i for i, link in enumerate(names) if link.startswith(leg)]
        legs[leg] = np.concatenate([poses[:, chain, :3], feet[:, j : j + 1]], axis=1)
    far = [leg for leg in legs if leg.startswith("left")]
    hips = [legs[leg][:, :1] for leg in (*far, *reversed([n for n in legs if n not in far]))]
    body = np.concatenate(hips, axis=1)
    parts = [
        *(_moving("polyline", "far " + name, seen(legs[leg]), seconds) for leg in far),
        _moving("polygon", "body " + name, seen(body), seconds),
        *(
            _moving("polyline", "leg " + name, seen(points), seconds)
            for leg, points in legs.items()
            if leg not in far
        ),
    ]
    acceleration = float(all_six[_SCENARIO].objectives["acceleration"][0])
    speed = 1.0 / float(all_six[_SCENARIO].objectives["reciprocal_speed"][0])
    numbers = [
        (words, ""),
        (f"fitness {all_six.fitness.item():.2f}", "number"),
        (f"body shaken by {acceleration:.2f} m/s²", ""),
        (f"{100.0 * speed:.1f} cm/s", ""),
    ]
    written = "".join(
        f'<text x="16" y="{40 + 24 * line}" class="{style}">{text}</text>\n'
        for line, (text, style) in enumerate(numbers)
    )
    return (
        f'<g transform="translate(0 {k * _ROW})">\n{written}'
        f"{_ground(moved, seconds)}{''.join(parts)}</g>\n"
    )


def _screen(points: Points) -> Points:
    """Positions (..., 3) relative to the body [m] to places (..., 2) in the picture [px]."""
    x, y, z = np.moveaxis(points, -1, 0)
    across = _WIDTH * 0.64 + _SCALE * (x + 0.18 * y)
    down = _ROW - 50.0 - _SCALE * (0.96 * z + 0.22 * y)
    return np.stack([across, down], axis=-1)


def _ground(moved: Points, seconds: float) -> str:
    """Marks that pass; they restart with the walk."""
    left, right = float(_LEFT), _WIDTH - 16.0
    count = int((right - left) / _SCALE / _MARK + (moved[-1] - moved[0]) / _MARK) + 2
    (far, near) = (_screen(np.array([0.0, side * _STRIP, 0.0])) for side in (1.0, -1.0))
    line = f"l{near[0] - far[0]:.0f} {near[1] - far[1]:.0f}"
    marks = "".join(f"M{left + k * _MARK * _SCALE:.0f} {far[1]:.0f}{line}" for k in range(count))
    places = ";".join(f"{-_SCALE * (x - moved[0]):.1f} 0" for x in moved)
    name = f"ground{moved[-1]:.6f}".replace(".", "-")
    return (
        f'<clipPath id="{name}"><path d="M{left} 0H{right}V{_ROW}H{left}Z"/></clipPath>\n'
        f'<g clip-path="url(#{name})"><path class="ground" d="{marks}">'
        f'<animateTransform attributeName="transform" type="translate" dur="{seconds:g}s"'
        f' repeatCount="indefinite" values="{places}"/></path></g>\n'
    )


def _moving(tag: str, style: str, points: Points, seconds: float) -> str:
    """A line through points that move, (F, N, 2) [px]."""
    frames = [" ".join(f"{x:.0f},{y:.0f}" for x, y in frame) for frame in points]
    return (
        f'<{tag} class="{style}" points="{frames[0]}"><animate attributeName="points"'
        f' dur="{seconds:g}s" repeatCount="indefinite" values="{";".join(frames)}"/></{tag}>\n'
    )


if __name__ == "__main__":
    main()
