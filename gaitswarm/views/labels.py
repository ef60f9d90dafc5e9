"""How many jobs there are of each value of what they are found by."""

from __future__ import annotations

from pydantic import Field

from gaitswarm.services.optimizer.jobs.labels import FacetCounts
from gaitswarm.views.base import View


class JobFacetsView(View):
    """Counts of jobs; those that have no robot, controller or preference are in the total alone."""

    total: int = Field(description="Jobs in all [1].", examples=[1000])
    states: dict[str, int] = Field(description="By state [1].", examples=[{"succeeded": 12}])
    robots: dict[str, int] = Field(description="By name of the robot [1].")
    controllers: dict[str, int] = Field(description="By motor controller [1].")
    preferences: dict[str, int] = Field(description="By preference, `own` for any other [1].")
    tags: dict[str, int] = Field(description="By tag [1].", examples=[{"thesis": 3}])

    @classmethod
    def from_counts(cls, counts: FacetCounts) -> JobFacetsView:
        """Make a view of counts."""
        return cls(
            total=counts.total,
            states=counts.states,
            robots=counts.robots,
            controllers=counts.controllers,
            preferences=counts.preferences,
            tags=counts.tags,
        )
