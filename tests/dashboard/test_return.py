"""The service ends and comes back under a page that stays open."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import expect

from maya_un import __version__
from maya_un.assembly.controller import make_twin
from maya_un.dashboard.pages import BROTLI
from tests.conventions.source import ROOT
from tests.dashboard.services import Service, ServiceProcess, service
from tests.dashboard.tabs import GONE, PATIENCE, SIZES, Tab, stop_in_sight
from tests.dashboard.test_access import Examiner
from tests.system.processes import running
from tests.waiting import eventually

GRIPPER = ("open", "close") * 3
JOB = {"name": "open and close", "steps": [{"gripper": state} for state in GRIPPER]}
"""Steps of half a second that need no homing."""

LONG_JOB = {**JOB, "repeat": 10}
"""A job that lasts longer than a busy machine takes to look."""


@pytest.fixture
def own(tmp_path: Path) -> Iterator[ServiceProcess]:
    """Return a service that the test may kill."""
    with service(tmp_path, "") as made:
        yield made


@pytest.fixture
def kept_tab(own: Service, tab_of: Callable[..., Tab]) -> Tab:
    """Return a tab of it, marked so that a reload would be noticed."""
    tab = tab_of(own, worker=True)
    tab.forgive(*GONE)
    tab.open("/")
    tab.page.evaluate("window.marked = true")
    return tab


def begin_long_job(own: Service) -> int:
    """Begin the long job and return its number once a step has an effect: then the journal has its beginning."""
    since = own.newest
    number: int = own.ask("POST /v1/jobs", LONG_JOB)["id"]
    own.until_event("gripper_closed", since)
    return number


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
    expect(kept_tab.page.locator("[data-home] [role=tooltip]")).to_contain_text("There is no connection")
    expect(kept_tab.page.locator("[data-why-speed]")).to_contain_text("There is no connection")
    kept_tab.page.click("button.stop >> visible=true")
    kept_tab.until("document.querySelector('[data-stopped]').innerText.includes('Use the emergency stop.')")
    own.start()
    kept_tab.until("!document.querySelector('[data-lost]')")
    kept_tab.until_live()
    assert kept_tab.get("window.marked")
    assert not own.state["moving"]


SEED = 5
"""It draws the place where the arm of the separate twin is when its power comes on."""

YAML = "\n".join(["name: open and close", "steps:", *(f"  - gripper: {state}" for state in GRIPPER)])
"""The same job, as a person writes it."""


class SeparateTwin:
    """A virtual controller with a part between the open jaws. It stays on while its service is killed."""

    def __init__(self, folder: Path) -> None:
        self._record = folder / "mechanics.jsonl"
        place = make_twin(seed=SEED).mechanics.gripper_point()
        table = folder / "table.json"
        table.write_text(json.dumps({"name": "table", "parts": {"cube": place}, "steps": ["home"]}), encoding="utf-8")
        self.options = f"dmc serve --port 0 --seed {SEED} --record {self._record} --table {table}"

    def record(self) -> list[dict[str, Any]]:
        """Return what the mechanics have recorded."""
        return [json.loads(line) for line in self._record.read_text(encoding="utf-8").splitlines()]

    def grips(self) -> list[str]:
        """Return what the gripper has done to the part, in order."""
        return [one["kind"] for one in self.record() if one["kind"] in {"grip", "release", "drop"}]


@pytest.fixture
def separate(tmp_path: Path) -> Iterator[tuple[SeparateTwin, Service]]:
    """Return a virtual controller in a process of its own, and a service that drives it."""
    twin = SeparateTwin(tmp_path)
    with running(twin.options) as process, service(tmp_path, f"--address {process.until('127.0.0.1:')}") as made:
        yield twin, made


def test_after_a_power_cut_a_person_decides_and_the_job_ends(
    separate: tuple[SeparateTwin, Service], tab_of: Callable[..., Tab]
) -> None:
    """The page asks what it cannot know. The mechanics show that no step is left out and none is done twice."""
    twin, own = separate
    tab = tab_of(own, worker=True, locale="es")
    tab.forgive(*GONE)
    tab.open("/queue")
    tab.page.evaluate("window.marked = true")
    tab.page.press("[data-open-text]", "Enter")  # a click would miss it if a list above it grows
    tab.page.fill("[data-yaml]", YAML)
    tab.press("submit")
    eventually(lambda: "grip" in twin.grips(), "the part is gripped", PATIENCE)
    come_back(own, tab)
    dialog = tab.page.locator("[data-recovery]")
    expect(dialog).to_contain_text("open and close")
    stop_in_sight(tab)
    before = twin.record()
    decide = dialog.locator("[data-decide]")
    expect(decide.get_by_role("button")).to_have_attribute("aria-disabled", "true")
    if dialog.locator("[data-holding=no]").count():  # it asks only what the machine does not know
        dialog.locator(f"[data-holding={'yes' if before[-1]['carried'] else 'no'}]").check()
    dialog.locator("[data-choice=resume]").check()
    assert twin.record() == before
    decide.click()
    expect(dialog).to_have_count(0)
    expect(tab.page.locator("[data-ended] [data-job]")).to_contain_text("hecho")
    assert twin.grips() == ["grip", "release", "grip", "release", "grip"]


@pytest.mark.parametrize("size", ["desktop", pytest.param("phone", marks=pytest.mark.long)])
def test_the_page_is_usable_for_everybody_without_the_service_and_after_it(
    own: Service, tab_of: Callable[..., Tab], size: str
) -> None:
    width, height = SIZES[size]
    tab = tab_of(own, worker=True, width=width, height=height, bypass_csp=True)
    tab.forgive(*GONE)
    tab.open("/")
    begin_long_job(own)
    examiner = Examiner(tab, size)
    own.kill()
    tab.until("document.querySelector('[data-lost]')")
    examiner.walk("lost", [])
    own.start()
    tab.until("document.querySelector('[data-recovery]')")
    examiner.walk("interrupted", [])
    assert examiner.found == []


def test_a_decision_can_wait(own: Service, kept_tab: Tab) -> None:
    job = begin_long_job(own)
    come_back(own, kept_tab)
    kept_tab.until("document.querySelector('[data-recovery]')")
    kept_tab.page.keyboard.press("Escape")
    kept_tab.until("!document.querySelector('[data-recovery]')")
    assert own.ask("GET /v1/queue")["recovery"]["job"] == job


NEWER = "0.2.0.newer"
"""A version that was never published."""


def copy_as_newer(folder: Path) -> None:
    """Copy the packages as another version, whose pages have files of other names, as each build has."""
    for package in ("dmc41x3", "maya_un"):
        shutil.copytree(
            ROOT / "src" / package, folder / package, ignore=shutil.ignore_patterns("__pycache__", f"*{BROTLI}")
        )
    init = folder / "dmc41x3" / "__init__.py"
    init.write_text(init.read_text(encoding="utf-8").replace(__version__, NEWER), encoding="utf-8")
    site = folder / "maya_un" / "dashboard" / "site"
    names = {file.name: file.name.replace("-", "-newer") for file in (site / "assets").iterdir()}
    for file in [*site.iterdir(), *(site / "assets").iterdir()]:
        if file.suffix in {".js", ".css", ".html"}:
            text = file.read_text(encoding="utf-8")
            for name, other in names.items():
                text = text.replace(name, other)
            file.write_text(text, encoding="utf-8")
        if file.name in names:
            file.rename(file.with_name(names[file.name]))


def test_a_page_of_another_version_says_so_and_is_loaded_again_at_rest(
    own: ServiceProcess, tab_of: Callable[..., Tab], tmp_path: Path
) -> None:
    """It goes on, loses no draft, and says what it cannot load; where browsers allow it, its worker keeps all files."""
    copy_as_newer(tmp_path / "newer")
    tab = tab_of(own)
    tab.forgive(*GONE, "status of 404", "dynamically imported module")
    tab.open("/queue")
    tab.page.evaluate("window.marked = true")
    tab.page.press("[data-open-text]", "Enter")  # a click would miss it if a list above it grows
    tab.page.fill("[data-yaml]", YAML)
    own.environment["PYTHONPATH"] = str(tmp_path / "newer")
    come_back(own, tab)
    assert own.ask("GET /v1/status")["version"] == NEWER
    offer = tab.page.locator("[data-new-version]")
    expect(offer).to_contain_text("another version")
    expect(tab.page.locator("[data-yaml]")).to_have_value(YAML)
    own.ask("POST /v1/tasks", {"command": "home"})
    expect(offer.get_by_role("button")).to_have_count(0)
    own.ask("POST /v1/stop")
    expect(offer.get_by_role("button")).to_be_visible()
    tab.page.click(".rail a[href='/people']")
    expect(tab.page.locator("[data-not-loaded]")).to_be_visible()
    assert tab.get("window.marked")
    offer.get_by_role("button").click()
    expect(tab.page.locator("[data-lease]")).to_be_visible()
    expect(offer).to_have_count(0)
    assert tab.get("window.marked ?? null") is None
    tab.page.click(".rail a[href='/queue']")
    expect(tab.page.locator("[data-yaml]")).to_have_value(YAML)
