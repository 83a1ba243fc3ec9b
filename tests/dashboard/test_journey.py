"""From the first visit to the first part that the robot has moved."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from tests.dashboard.services import Service, service
from tests.dashboard.tabs import Tab
from tests.system.processes import CALM

EXAMPLE = "01_pick_and_place"


@pytest.fixture
def new(tmp_path: Path) -> Iterator[Service]:
    """Return a service that nobody has used, with a fast clock and the parts of the example on the twin's table."""
    with service(tmp_path, f"--speed 100 --table examples/{EXAMPLE}.yaml {CALM}") as made:
        yield made


def submit_example(tab: Tab, robot: Service) -> int:
    """Submit the example, and return the number of its job."""
    example = next(one for one in robot.ask("GET /v1/examples") if one["name"] == EXAMPLE)
    job = robot.ask("POST /v1/jobs/parse", {"text": example["text"]})["job"]
    return robot.ask("POST /v1/jobs", job)["id"]


def test_first_visit_home_pick_and_place(new: Service, tab_of: Callable[..., Tab]) -> None:
    """The page takes the language of the browser."""
    tab = tab_of(new, locale="es")
    tab.open("/")
    assert tab.get("document.documentElement.lang") == "es"
    tab.until("document.querySelector('[data-scene]')?.dataset.drawn")
    tab.until("document.querySelector('[data-state].warn')", "it is not homed")
    tab.page.click("[data-home] button, button[data-home]")
    tab.until("document.querySelector('[data-state].ok')", "it is ready")
    assert new.state["homed"]
    job = submit_example(tab, new)
    new.until(lambda report: report["state"] == "done", f"/v1/jobs/{job}")
    tab.page.click(".rail a[href='/history']")
    tab.until("document.querySelector('main').innerText.includes('pick and place')")
    assert tab.get("document.querySelector('main').innerText.includes('{}')".format("hecho"))
