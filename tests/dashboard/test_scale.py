"""A service that has been used for years: ten thousand ended jobs, two hundred poses, and a clock that runs fast."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from datetime import UTC, datetime

import pytest
from playwright.sync_api import expect

from tests.dashboard.furnished import furnished_robot
from tests.dashboard.inside import TwinService
from tests.dashboard.services import SPEED
from tests.dashboard.tabs import Tab

JOBS, POSES = 10_000, 200

FEW = 3_000
"""A page with more elements than this is slow."""

ELEMENTS = "document.querySelectorAll('*').length"


@pytest.fixture(scope="module")
def old(tmp_path_factory: pytest.TempPathFactory) -> Iterator[TwinService]:
    """Return a robot with many jobs and poses."""
    with furnished_robot(tmp_path_factory.mktemp("old"), jobs=JOBS, poses=POSES) as made:
        yield made


def test_the_history_of_ten_thousand_jobs_is_searched_and_paged(old: TwinService, tab_of: Callable[..., Tab]) -> None:
    tab = tab_of(old)
    tab.open("/history")
    jobs = tab.page.locator("[data-jobs] > li")
    expect(jobs.nth(1)).to_contain_text(f"tray {JOBS}")
    assert tab.get(ELEMENTS) < FEW
    shown = jobs.count()
    tab.page.click("[data-more]")
    expect(jobs).to_have_count(2 * shown)
    tab.page.fill("[data-search]", "tray 00042")
    expect(jobs).to_have_count(1)
    expect(jobs).to_contain_text("tray 00042")
    tab.page.fill("[data-search]", "no such job")
    expect(jobs).to_have_count(0)
    tab.page.fill("[data-search]", "")
    tab.page.select_option("[data-order]", "oldest")
    expect(jobs.first).to_contain_text("tray 00001")
    assert tab.get(ELEMENTS) < FEW


def test_two_hundred_poses_are_searched_and_chosen(old: TwinService, tab_of: Callable[..., Tab]) -> None:
    last = f"shelf{POSES - 1:03}"
    tab = tab_of(old)
    tab.open("/teach")
    poses = tab.page.locator("[data-pose]")
    expect(poses.first).to_contain_text(last)
    shown = poses.count()
    assert shown < POSES
    assert tab.get(ELEMENTS) < FEW
    assert tab.page.locator("svg .pose text").count() == 0, "names would cover each other"
    tab.page.click("[data-more]")
    expect(poses).to_have_count(2 * shown)
    tab.page.fill("main [data-search]", "SHELF042")
    expect(poses).to_have_count(1)
    tab.page.click(".rail a[href='/queue']")
    tab.page.locator("[data-blocks]").get_by_role("button", name="Move joints", exact=True).click()
    tab.page.locator("[data-blocks] select").select_option(label=last)
    expect(tab.page.locator("[data-yaml]")).to_have_value(f"steps:\n- move: {last}\n")


LONG = {"name": "a thousand seconds", "steps": [{"gripper": state} for state in ("open", "close")], "repeat": 1000}
"""A job of the robot's time; the clock of the twin runs through it in less than a minute."""


def test_the_end_of_the_queue_is_a_time_of_the_persons_clock(old: TwinService, tab_of: Callable[..., Tab]) -> None:
    """The page says that the clock of the twin is fast, and counts with it."""
    tab = tab_of(old, locale="en")
    tab.open("/queue")
    old.ask("POST /v1/jobs", LONG)
    tab.press("queue-resume")
    expect(tab.page.locator("[data-running]")).to_contain_text("a thousand seconds")
    expect(tab.page.locator("[data-queue-controls]")).to_contain_text(f"{SPEED} times as fast")
    said = tab.page.locator("[data-finish]").inner_text()
    hours, minutes = (int(part) for part in said[-5:].split(":"))
    now = datetime.now(UTC).astimezone()
    assert (60 * hours + minutes - 60 * now.hour - now.minute) % (24 * 60) <= 2
    tab.page.keyboard.press("Escape")
    tab.page.keyboard.press("Escape")
