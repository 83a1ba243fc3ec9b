"""The service ends and comes back under a page that stays open."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from tests.dashboard.services import Service, service
from tests.dashboard.tabs import Tab, stop_in_sight

STEPS = 6
JOB = {"name": "open and close", "steps": [{"gripper": ("open", "close")[step % 2]} for step in range(STEPS)]}
"""Steps of half a second that need no homing."""

GONE = (
    *("ERR_CONNECTION_REFUSED", "ERR_CONNECTION_RESET", "ERR_EMPTY_RESPONSE"),
    "error occurred when fetching the script",
)
"""The browser itself writes these to the console about a service that is not there."""


@pytest.fixture
def own(tmp_path: Path) -> Iterator[Service]:
    """Return a service that the test may kill."""
    with service(tmp_path, "") as made:
        yield made


@pytest.fixture
def kept_tab(own: Service, tab_of: Callable[..., Tab]) -> Tab:
    """Return a tab of it, marked so that a reload would be noticed."""
    tab = tab_of(own)
    tab.forgive(*GONE)
    tab.open("/")
    tab.page.evaluate("window.marked = true")
    return tab


def come_back(own: Service, tab: Tab) -> None:
    """Kill the service, see that the page says so, start it again, and see that the page goes on."""
    own.kill()
    tab.until("document.querySelector('[data-lost]')")
    stop_in_sight(tab)
    own.start()
    tab.until("!document.querySelector('[data-lost]')")
    tab.until_live()
    assert tab.get("window.marked")


def test_the_page_says_that_the_service_is_gone_and_goes_on_when_it_is_back(own: Service, kept_tab: Tab) -> None:
    assert "The robot may still move." not in kept_tab.text()
    own.kill()
    kept_tab.until("document.querySelector('[data-lost]')?.innerText.includes('The robot may still move.')")
    assert kept_tab.get("document.querySelector('.app').classList.contains('stale')")
    kept_tab.page.click("button.stop >> visible=true")
    kept_tab.until("document.querySelector('[data-stopped]').innerText.includes('Use the emergency stop.')")
    own.start()
    kept_tab.until("!document.querySelector('[data-lost]')")
    kept_tab.until_live()
    assert kept_tab.get("window.marked")
    assert not own.state["moving"]


def test_after_a_power_cut_a_person_decides_and_the_job_ends(own: Service, kept_tab: Tab) -> None:
    job = own.ask("POST /v1/jobs", JOB)["id"]
    own.until(lambda report: report["steps"][1]["state"] == "running", f"/v1/jobs/{job}")
    come_back(own, kept_tab)
    kept_tab.until("document.querySelector('[data-recovery]')?.innerText.includes('open and close')")
    stop_in_sight(kept_tab)
    assert own.ask("GET /v1/queue")["mode"] == "paused"
    dialog = kept_tab.page.locator("[data-recovery]")
    decide = dialog.locator("[data-decide] button")
    assert decide.get_attribute("aria-disabled") == "true"
    if dialog.locator("[data-holding=no]").count():  # it asks only what the machine does not know
        dialog.locator("[data-holding=no]").check()
    dialog.locator("[data-choice=resume]").check()
    decide.click()
    kept_tab.until("!document.querySelector('[data-recovery]')")
    report = own.until(lambda report: report["state"] == "done", f"/v1/jobs/{job}")
    assert [step["state"] for step in report["steps"]] == ["done"] * STEPS


def test_a_decision_can_wait(own: Service, kept_tab: Tab) -> None:
    job = own.ask("POST /v1/jobs", JOB)["id"]
    own.until(lambda report: report["steps"][0]["state"] == "running", f"/v1/jobs/{job}")
    come_back(own, kept_tab)
    kept_tab.until("document.querySelector('[data-recovery]')")
    kept_tab.page.keyboard.press("Escape")
    kept_tab.until("!document.querySelector('[data-recovery]')")
    assert own.ask("GET /v1/queue")["recovery"]["job"] == job
