"""The self-contained HTML page in an evidence file, and its figures."""

from __future__ import annotations

import io
import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from gaitswarm.services.optimizer.analysis.certificate import CertificateView
from gaitswarm.services.optimizer.errors import InvalidRequest
from gaitswarm.services.optimizer.jobs.job import Job
from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec
from gaitswarm.settings import place_of
from gaitswarm.sim.robot import load_robot
from gaitswarm.views.job import BestView, IterationView

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MANIFEST: Final = "manifest.json"

_INK: Final = "#1f3a5f"
_ACCENT: Final = "#d1495b"

_WORST: Final = 10
"""Worst worlds of a certificate that the page lists."""


@dataclass(frozen=True, slots=True)
class CertificateOnPage:
    """A certificate as the page shows it."""

    view: CertificateView
    place: tuple[int, int] | None = None  # of the design in the job; None on the job's own page
    is_best: bool = False

    @property
    def robot(self) -> str:
        return load_robot(self.view.robot).description.name


def page(
    job: Job,
    best: BestView | None,
    iterations: Sequence[IterationView],
    certificates: Sequence[CertificateOnPage],
    files: Sequence[str],
) -> str:
    """Write the page."""
    import jinja2

    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("gaitswarm.evidence", ""),
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
        undefined=jinja2.StrictUndefined,
    )
    environment.filters |= {"number": _number, "place": lambda place: place_of(*place)}
    return environment.get_template("page.html").render(
        job=job,
        spec=job.spec,
        best=best,
        tunes_a_drive=isinstance(job.spec, JobSpec),
        units={variable.name: variable.unit for variable in job.spec.design_space().variables},
        figure=_svg(draw_convergence(iterations, title="Fitness over iterations")),
        certificates=certificates,
        worst=_WORST,
        files=sorted(files),
        manifest=MANIFEST,
    )


def _number(value: float | str | None) -> str:
    if value is None:
        return "–"
    return value if isinstance(value, str) else f"{value:.6g}"


def draw_convergence(iterations: Sequence[IterationView], *, title: str) -> Figure:
    """Draw fitness (minimized) over iterations: best so far, median, and the best-worst band."""
    from matplotlib.figure import Figure
    from matplotlib.ticker import LogLocator, MaxNLocator, NullFormatter, StrMethodFormatter

    if not iterations:
        raise InvalidRequest("the job has no committed iteration to draw yet")
    figure = Figure(figsize=(8.0, 4.5), layout="constrained")
    axes = figure.add_subplot()
    axes.set_title(title, loc="left", weight="bold")
    axes.spines[["top", "right"]].set_visible(False)
    index = [i.index for i in iterations]
    best, median, worst, so_far = (
        # None becomes NaN.
        np.array([getattr(i, name) for i in iterations], dtype=np.float64)
        for name in ("best", "median", "worst", "best_so_far")
    )
    axes.fill_between(index, best, worst, color=_INK, alpha=0.12, lw=0, label="designs")
    axes.plot(index, median, color=_INK, alpha=0.6, lw=1.2, label="median of the iteration")
    label = f"best so far, finally {so_far[-1]:.4g}"
    axes.step(index, so_far, where="post", color=_ACCENT, lw=2.2, label=label)
    axes.set_yscale("log")
    # 25 instead of 2.5 x 10^1: a fitness varies by less than a decade.
    axes.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0), numticks=12))
    axes.yaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
    axes.yaxis.set_minor_formatter(NullFormatter())
    axes.set_xlim(index[0], max(index[-1], index[0] + 1))
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    axes.set_xlabel("iteration")
    axes.set_ylabel("fitness, minimized  [1]")
    axes.grid(visible=True, which="both", color="0.9", lw=0.6)
    axes.legend(frameon=False, loc="upper right")
    return figure


def _svg(figure: Figure) -> str:
    """An SVG element; equal figures are equal texts."""
    import matplotlib as mpl

    sink = io.StringIO()
    metadata = dict.fromkeys(("Creator", "Date", "Format", "Type"))
    with mpl.rc_context({"svg.hashsalt": "gaitswarm", "svg.fonttype": "none"}):
        figure.savefig(sink, format="svg", metadata=metadata)
    return re.sub(r"^.*?(?=<svg )", "", sink.getvalue(), flags=re.DOTALL)
