"""A page of another site, open in the same browser, can change nothing here."""

from __future__ import annotations

import httpx2
import pytest

from services.optimizer.jobs.job import Job

ELSEWHERE = {"Sec-Fetch-Site": "cross-site", "Origin": "https://elsewhere.example"}


def test_another_sites_page_cannot_cancel_a_job(client: httpx2.Client, job: Job) -> None:
    answer = client.post(f"/v1/jobs/{job.id}/cancel", headers=ELSEWHERE)
    assert answer.status_code == 403
    assert answer.json()["type"] == "urn:gaitswarm:problem:cross-site"
    assert client.get(f"/v1/jobs/{job.id}").json()["state"] == job.state


@pytest.mark.parametrize("site", ["same-origin", "same-site", "none", None])
def test_the_servers_own_page_and_other_programs_can(
    client: httpx2.Client, job: Job, site: str | None
) -> None:
    headers = {} if site is None else {"Sec-Fetch-Site": site}
    assert client.post(f"/v1/jobs/{job.id}/cancel", headers=headers).status_code == 200


def test_another_site_may_link_here(client: httpx2.Client) -> None:
    assert client.get("/v1/healthz", headers=ELSEWHERE).status_code == 200
