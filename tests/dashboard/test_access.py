"""Pages, dialogues and all that opens within pages are usable for everybody: axe finds nothing against WCAG 2.2 AA."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

import pytest
from playwright.sync_api import Browser, expect

from tests.campaign import Campaign
from tests.conventions.source import ROOT
from tests.dashboard.conftest import new_tab
from tests.dashboard.furnished import FAILED
from tests.dashboard.inside import TwinService
from tests.dashboard.services import PASSWORD, Service
from tests.dashboard.tabs import SIZES, THEMES, Tab

AXE = ROOT / "web" / "node_modules" / "axe-core" / "axe.min.js"
RULES = ["wcag2a", "wcag2aa", "wcag21a", "wcag21aa", "wcag22aa"]

CONTRAST = ["color-contrast"]
"""The only rule whose result depends on the theme."""

Step = str
"""A click on what a selector finds first, "maybe SELECTOR", "see SELECTOR", "key NAME", "type SELECTOR = TEXT"."""

CLOSE = "key Escape"

WALKS: Sequence[tuple[str, Sequence[Sequence[Step]]]] = (
    ("/", [["[data-next]"], ["[data-next]"], ["[data-next]"], ["[data-next]"], ["[data-next]"]]),
    ("/drive", [["maybe [data-tab=goto]", "[data-look]"], ["maybe [data-tab=keys]"]]),
    (
        "/queue",
        [
            ["[data-ended] .main"],
            ["[data-queue-clear]"],
            [CLOSE, "[data-examples] button", "[data-do-preview] button:not([aria-disabled])", "see [data-preview]"],
            [".more summary"],
        ],
    ),
    (
        "/teach",
        [
            ["maybe [data-drive-here]:not([open]) summary"],
            ["[data-here]"],
            ["[data-again]"],
            [CLOSE, "[data-rename]"],
            [CLOSE, "[data-remove]"],
            ["[data-tab=pallets]"],
            ["[data-remove]"],
            ["[data-new-pallet]"],
            ["[data-tab=zones]"],
            ["[data-remove]"],
            ["[data-add-box]"],
        ],
    ),
    (f"/history?job={FAILED}", []),
    ("/history?show=recordings", [["[data-recording]"]]),
    (
        "/workshop",
        [
            [".tool[href$=scope]"],
            [".tool[href$=terminal]"],
            [
                ".tool[href$=configuration]",
                "type [data-find] = delta",
                "type [data-setting='geometry.delta'] input = x",
            ],
            [".tool[href$=calibration]", "see [data-points] tbody tr", "[data-fit]", "see [data-map] .arrow"],
            ["[data-remove-point]"],
            [CLOSE, "[data-clear]"],
            [".tool[href$=faults]"],
            [".tool[href$=logs]", "[data-details]"],
        ],
    ),
    ("/robots", []),
    ("/people", [["[data-no-users] .primary"]]),
)
"""Addresses, and the steps from each stage to the next one; every stage is looked at."""

ROOT_WALK: Sequence[Sequence[Step]] = [
    ["[data-approvals] .button", "see [data-proposal] li"],
    [CLOSE, "[data-users] .row .button"],
    [CLOSE, "[data-users] .line .button"],
    ["[data-user] .actions .button"],
    [CLOSE, CLOSE, "[data-phone]"],
    ["[data-show-code]", "see [data-phone-dialog] svg[role=img]"],
    [CLOSE, "[data-phone] + .button"],
]
"""The same on the page People for an administrator."""


EXAMINE = """async ([rules, whole]) => {
    const part = document.querySelector('dialog[open], main .question, [data-tour]') ?? document.querySelector('main');
    const bars = [...document.querySelectorAll('.head, .dock')];
    for (const bar of bars) bar.style.visibility = whole ? '' : 'hidden';
    const { violations } = await axe.run(whole ? document : part, { ...rules, resultTypes: ['violations'] });
    for (const bar of bars) bar.style.visibility = '';
    return violations.flatMap((one) => one.nodes.map((node) => `${one.id}: ${node.html}`));
}"""
"""Returns what axe finds on the whole page, or in the part that a step opens: then no bar lies over anything."""


ON_FIRST_SCREEN = """(part) => {
    const [box, stop] = [part, '.dock .stop'].map((one) => document.querySelector(one)?.getBoundingClientRect());
    return scrollY === 0 && box?.height > 0 && box.top >= 0 && box.bottom <= (stop.height ? stop.top : innerHeight);
}"""
"""Tells whether a part is to be seen without scrolling, above the stop button of a phone."""


class Examiner:
    """Has axe look at the stages of pages, and collects what it finds."""

    def __init__(self, tab: Tab, size: str) -> None:
        self._tab = tab
        self.size = size
        self.found: list[str] = []

    @property
    def problems(self) -> list[str]:
        """The problems of the tab."""
        return self._tab.problems

    def open(self, path: str) -> None:
        """Load a page, or go to it if a page is there, and forget what was found on others."""
        self.found.clear()
        self.problems.clear()
        (self._tab.go if self._tab.addresses else self._tab.open)(path)

    def walk(self, where: str, stages: Sequence[Sequence[Step]]) -> None:
        """Look at the page that is open, then go on from stage to stage, and look at what each one opens."""
        if not self._tab.get("'axe' in window"):
            self._tab.page.evaluate(AXE.read_text(encoding="utf-8"))
        self._look(where, whole=True)
        for steps in stages:
            for step in steps:
                do(self._tab, step)
            self._look(f"{where} after {steps}", whole=False)

    def _look(self, where: str, *, whole: bool) -> None:
        """Look at everything in one theme, at the colours in the other; on a phone, parts have the same colours."""
        rules: dict[str, object] = {"runOnly": {"type": "tag", "values": RULES}}
        themes = THEMES
        if not whole and self.size == "phone":
            rules |= {"rules": {name: {"enabled": False} for name in CONTRAST}}
            themes = THEMES[:1]
        for theme in themes:
            self._tab.page.evaluate("(theme) => { document.documentElement.dataset.theme = theme }", theme)
            found: list[str] = self._tab.page.evaluate(EXAMINE, [rules, whole])
            self.found += [f"{where}, {self.size}, {theme}: {one}" for one in found]
            rules = {"runOnly": {"type": "rule", "values": CONTRAST}}


def do(tab: Tab, step: Step) -> None:
    """Carry out a step."""
    kind, _, rest = step.partition(" ")
    if kind == "key":
        tab.page.keyboard.press(rest)
    elif kind == "see":
        expect(tab.page.locator(rest).first).to_be_visible()
    elif kind == "type":
        where, _, text = rest.partition(" = ")
        tab.page.fill(f"{where} >> visible=true", text)
    elif kind != "maybe" or tab.page.locator(rest).count():
        tab.page.click(f"{rest if kind == 'maybe' else step} >> visible=true >> nth=0")


Opened = Callable[[Service], tuple[Tab, Examiner]]


@pytest.fixture(params=["desktop", "phone"])
def examiner_of(request: pytest.FixtureRequest, tab_of: Callable[..., Tab]) -> Opened:
    """Return what opens a tab of a size for a service, and the examiner of its pages."""
    width, height = SIZES[request.param]

    def opened(of: Service) -> tuple[Tab, Examiner]:
        tab = tab_of(of, width=width, height=height, bypass_csp=True)
        return tab, Examiner(tab, request.param)

    return opened


@pytest.fixture(scope="module", params=["desktop", "phone"])
def visitor(request: pytest.FixtureRequest, furnished: TwinService, chromium: Browser) -> Iterator[Examiner]:
    """Return the examiner of a tab for the furnished robot, which loads the page and axe once for all tests."""
    width, height = SIZES[request.param]
    tab = new_tab(chromium, furnished, width=width, height=height, bypass_csp=True)
    yield Examiner(tab, request.param)
    tab.page.context.close()


@pytest.mark.parametrize(("path", "stages"), WALKS, ids=[path for path, _ in WALKS])
def test_page_and_what_opens_in_it(
    path: str, stages: Sequence[Sequence[Step]], visitor: Examiner, campaign: Campaign
) -> None:
    """axe examines the stages of a page on a large screen, and with `./test --long` on a phone too."""
    visitor.open(path)
    visitor.walk(path, stages if campaign.long or visitor.size != "phone" else ())
    assert (visitor.found, visitor.problems) == ([], [])


def test_a_job_that_runs_and_a_robot_that_moves(robot: TwinService, examiner_of: Opened) -> None:
    tab, examiner = examiner_of(robot)
    robot.begin_motion(0.02)  # axe takes long on a busy machine
    tab.open("/queue")
    examiner.walk("queue", [["[data-running] .toggle"], ["a.place[href='/']"]])
    assert robot.state["moving"]
    for part in ("[data-motion] [data-pause]", "[data-left]", "[data-driver-now]", "[data-speed-now]"):
        tab.until(f"({ON_FIRST_SCREEN})('{part}')", f"{part} is on the first screen")
    assert examiner.found == []


@pytest.fixture
def proposed(guarded: TwinService) -> Iterator[TwinService]:
    """Return the service with users: a student proposes a job, an operator drives and offers control."""
    root = guarded.token
    for name, role in (("ana", "student"), ("bea", "operator")):
        guarded.token = root
        guarded.refused("POST /v1/users", {"name": name, "role": role})
        guarded.token = guarded.ask(f"POST /v1/users/{name}/tokens", {"note": "a test"})["token"]
        if role == "student":
            guarded.ask("POST /v1/jobs", {"name": "mine", "steps": ["home"]})
    guarded.ask("POST /v1/lease", {})
    guarded.ask("POST /v1/lease/offer", {"to": "root"})
    guarded.token = root
    yield guarded
    lease = guarded.ask("POST /v1/lease", {"force": True})
    guarded.request("DELETE", "/v1/lease", Authorization=f"Bearer {root}", Maya_Lease=lease["id"])
    for job in guarded.ask("GET /v1/queue")["waiting"]:
        guarded.ask(f"DELETE /v1/jobs/{job['id']}")


@pytest.mark.parametrize("examiner_of", ["desktop", pytest.param("phone", marks=pytest.mark.long)], indirect=True)
def test_people_sign_in_and_look_after_each_other(proposed: TwinService, examiner_of: Opened) -> None:
    tab, examiner = examiner_of(proposed)
    tab.forgive("status of 401", "status of 429")
    tab.page.goto(f"{proposed.url}/people")
    tab.until("document.querySelector('dialog[open]')")
    name, password = "type dialog input[autocomplete=username] = root", "type dialog input[type=password] = "
    other_way = "dialog .chip[aria-pressed=false]"
    wrong = [name, f"{password}wrong", "key Enter", "see dialog [role=alert]"]
    right = [other_way, name, f"{password}{PASSWORD}", "key Enter", "see [data-users] li", "see [data-lease-notice]"]
    examiner.walk("sign in", [wrong, [other_way], right])
    examiner.walk("people", ROOT_WALK)
    assert examiner.found == []
