"""Preferences by how robust the designs are that win under them."""

from __future__ import annotations

from pydantic import Field

from gaitswarm.services.optimizer.jobs.preference import Preference
from gaitswarm.views.base import View
from gaitswarm.views.robustness import IndexView


class PreferenceWinnerView(View):
    """A design that is the best of its job under some preferences."""

    iteration: int = Field(description="Iteration of the job, from 0.", examples=[24])
    particle: int = Field(
        description="Number of the design in its iteration, from 0.", examples=[7]
    )
    design: dict[str, float | str] = Field(
        description="Value of every variable, by name.", examples=[{"I": 0.171, "FI1R": 5837.0}]
    )
    preference: Preference = Field(description="One under which it wins.")
    named: list[str] = Field(
        description="Preferences of table 4.5 under which it wins.", examples=[["A"]]
    )
    share: float = Field(
        description="Of the drawn preferences under which it wins [1].", examples=[0.21]
    )
    fitness: float | None = Field(
        description="By the job's own preference [1]; null if that has none for it.",
        examples=[17.6],
    )
    loss: float | None = Field(
        description="By how much that is worse than the job's best, as a share [1].",
        examples=[0.02],
    )
    index: IndexView | None = Field(
        description="Its robustness index over all scenarios; null where too many walks around it"
        " failed."
    )


class RobustPreferencesView(View):
    """Which preference's winner is the most robust, among the designs of one job."""

    drawn: int = Field(description="Preferences beside A, B and C.", examples=[512])
    winners: int = Field(description="Different designs that win under any.", examples=[14])
    samples: int = Field(description="Designs walked around each candidate.", examples=[128])
    radius: float = Field(
        description="How far they were from it at most, as a share of the bounds [1].",
        examples=[0.02],
    )
    seed: int = Field(description="Of preferences and samples.", examples=[1])
    candidates: list[PreferenceWinnerView] = Field(
        description="Winners of A, B and C, and those of most other preferences; the most robust"
        " first."
    )
