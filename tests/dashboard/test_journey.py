"""Journeys of people through the page, by clicks and keys. The twin's mechanics show what the robot has really done."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from math import degrees, dist, pi
from pathlib import Path

import pytest
from playwright.sync_api import Locator, expect

from maya_un.machine.truth import TrueConstants
from maya_un.values import Joints, Point
from tests.calm import CALM_FILE
from tests.dashboard.furnished import MEASURED
from tests.dashboard.inside import Options, TwinService, twin_service
from tests.dashboard.tabs import GONE, SIZES, Tab
from tests.secrecy import secret

FAST = 200.0
"""Speed of the clock of robots that only these journeys use."""

CUBE, TRAY = Point(0.41, 1.13, 0.40), Point(1.18, 0.21, 0.40)
"""The part and the place of the first example."""

NEAR = 2e-3
"""A robot whose constants are right puts a part so near to its place [m]."""


@pytest.fixture
def new(tmp_path: Path) -> Iterator[TwinService]:
    """Return a robot that nobody has used, with the part of the first example on the table."""
    with twin_service(tmp_path, Options(FAST, homed=False, parts={"cube": CUBE})) as made:
        yield made


@pytest.fixture
def ready(tmp_path: Path) -> Iterator[TwinService]:
    """Return a homed robot with the part of the first example on the table."""
    with twin_service(tmp_path, Options(FAST, parts={"cube": CUBE})) as made:
        yield made


def enter(tab: Tab) -> None:
    """Open the page Live for the first time, and end the tour."""
    tab.open("/")
    tab.page.click("[data-tour] .plain")


def visit(tab: Tab, path: str) -> None:
    """Go to another page by the rail, or by the tabs of a phone."""
    tab.page.click(f"a.place[href='{path}'] >> visible=true")
    tab.until(f"location.pathname === '{path}'")


def require_placed(robot: TwinService, name: str, place: Point) -> None:
    """Fail unless a part stands at a place, was not dropped, and the lines were never overloaded."""
    parts, drops, tension = robot.record(lambda record: (record.parts, record.drops, record.peak_tension))
    assert dist(parts[name], place) < NEAR
    assert drops == ()
    assert tension < 6.0


def test_first_visit_home_pick_and_place(new: TwinService, tab_of: Callable[..., Tab]) -> None:
    """The page takes the language of the browser, shows the tour, homes, and runs an example job."""
    tab = tab_of(new, worker=True, locale="es")
    tab.open("/")
    assert tab.get("document.documentElement.lang") == "es"
    tour = tab.page.locator("[data-tour]")
    for title in ("Parar", "El estado del robot", "Primero, referenciar", "La cola", "Idioma"):
        expect(tour.get_by_role("heading")).to_have_text(title)
        tab.page.keyboard.press("Tab" if title == "Parar" else "Shift+Tab")
        tour.locator("[data-next]").press("Enter")
    expect(tour).to_have_count(0)
    tab.until("document.querySelector('[data-scene]')?.dataset.drawn")
    tab.until("document.querySelector('[data-state].warn')", "it is not homed")
    tab.press("home")
    tab.until("document.querySelector('[data-state].ok')", "it is ready")
    assert dist(new.state["point"], new.gripper) < NEAR
    visit(tab, "/queue")
    tab.page.click("[data-examples] button:first-of-type")
    expect(tab.page.locator("[data-blocks] > ol > li")).to_have_count(3)
    tab.press("do-preview")
    expect(tab.page.locator("[data-preview]")).to_contain_text("pick cube")
    tab.hide()
    tab.press("submit")
    tab.until("document.title === 'pick and place: hecho · Maya'", "a tab that nobody sees says that the job has ended")
    tab.hide(False)
    tab.until("document.title === 'Maya'", "no job runs, and the person sees the page")
    ended = tab.page.locator("[data-ended]").get_by_role("button", name="pick and place")
    expect(ended).to_be_visible()
    require_placed(new, "cube", TRAY)
    visit(tab, "/history")
    expect(tab.page.locator("[data-jobs]")).to_contain_text("hecho")


PEOPLE = {"ana": "student", "bea": "operator"}


@pytest.fixture
def shared(tmp_path: Path) -> Iterator[TwinService]:
    """Return a homed robot with a student and an operator, and a part on its table."""
    with twin_service(tmp_path, Options(FAST, stored=True, parts={"cube": CUBE})) as made:
        made.token = made.ask("POST /v1/users", {"name": "root", "role": "admin"})["token"]
        for name, role in PEOPLE.items():
            made.ask("POST /v1/users", {"name": name, "role": role, "password": secret(name)})
        yield made


def add_step(tab: Tab, command: str) -> Locator:
    """Add a block to the draft, and return it."""
    blocks = tab.page.locator("[data-blocks] > ol > li")
    before = blocks.count()
    tab.page.locator("[data-blocks]").get_by_role("button", name=command, exact=True).click()
    expect(blocks).to_have_count(before + 1)
    return blocks.nth(before)


def fill_point(of: Locator, point: Point) -> None:
    """Fill the fields for x, y, z in mm."""
    for axis, value in zip("xyz", point, strict=True):
        of.get_by_label(axis, exact=True).fill(f"{value * 1e3:g}")


def test_a_student_proposes_and_an_operator_approves(shared: TwinService, tab_of: Callable[..., Tab]) -> None:
    """Each has a browser of their own: the student a desktop in Spanish, the operator a phone in English."""
    width, height = SIZES["phone"]
    student, operator = tab_of(shared, locale="es"), tab_of(shared, width=width, height=height)
    for tab in (student, operator):
        tab.page.goto(f"{shared.url}/queue")
    student.sign_in("ana", secret("ana"))
    composer = student.page.locator("[data-composer]")
    composer.locator("[data-open-text]").press("Enter")
    composer.locator(".names summary").click()
    composer.get_by_role("button", name="Añadir una pieza").click()
    composer.locator(".named input.name").fill("cubo")
    composer.locator(".named input.name").press("Enter")
    fill_point(composer.locator(".named"), CUBE)
    pick, place = add_step(student, "Recoger"), add_step(student, "Colocar")
    pick.locator("select").select_option(label="cubo")
    place.locator("select").select_option(label="Coordenadas")
    fill_point(place, TRAY)
    student.page.get_by_role("button", name="Proponer el trabajo").click()
    expect(student.page.locator("[data-queued]")).to_contain_text("espera la aprobación")

    operator.sign_in("bea", secret("bea"))
    visit(operator, "/people")
    operator.page.locator("[data-approvals]").get_by_role("button", name="Review").click()
    proposal = operator.page.locator("[data-proposal]")
    expect(proposal).to_contain_text("proposed by ana")
    expect(proposal).to_contain_text("pick cubo")
    assert dist(shared.record(lambda record: record.parts)["cube"], CUBE) < NEAR
    proposal.get_by_role("button", name="Approve").click()
    expect(proposal).to_have_count(0)

    ended = student.page.locator("[data-ended] [data-job]")
    expect(ended).to_contain_text("hecho")
    require_placed(shared, "cube", TRAY)
    ended.get_by_role("button").click()
    expect(student.page.locator("[data-detail]")).to_contain_text("Aprobado por bea.")
    visit(operator, "/queue")
    expect(operator.page.locator("[data-ended] [data-job]")).to_contain_text("ana")


def drive_to(tab: Tab, robot: TwinService, joints: Joints) -> None:
    """Have the robot go to joints [rad, m, m] by the page Drive. A jog lets the first preview lapse."""
    tab.page.click("[data-primitive=move]")
    tab.page.click("[data-way=joints]")
    for name, value in zip("abc", (joints.a * 180.0 / pi, joints.b * 1e3, joints.c * 1e3), strict=True):
        tab.page.locator(f"[data-joint={name}] input").fill(f"{value:.4f}")
    tab.press("look")
    tab.until("document.querySelector('[data-go] button:not([aria-disabled])')", "a preview")
    robot.ask("POST /v1/jog", {"axis": "c", "distance": -0.01})
    expect(tab.page.locator("[data-go] [role=tooltip]")).to_contain_text("have changed since the preview")
    tab.press("look")
    tab.press("go")
    robot.until(lambda status: dist(status["state"]["joints"] or (9.0, 9.0, 9.0), joints) < NEAR)


def test_teach_two_poses_compose_a_job_from_them_and_run_it(robot: TwinService, tab_of: Callable[..., Tab]) -> None:
    """Another page shows each pose as soon as it is taught."""
    tab, watching = tab_of(robot), tab_of(robot, locale="es")
    watching.open("/teach")
    enter(tab)
    places: dict[str, Joints] = {}
    for name, joints in (("left", Joints(0.4, 1.4, 1.5)), ("right", Joints(1.3, 1.5, 1.4))):
        visit(tab, "/drive")
        drive_to(tab, robot, joints)
        visit(tab, "/teach")
        tab.page.fill("[data-pose-name]", name)
        tab.page.keyboard.press("Enter")
        expect(watching.page.locator(f"[data-pose={name}]")).to_contain_text("enseñada")
        places[name] = robot.truth(lambda twin: Joints(*twin.mechanics.true_joints()))
    visit(tab, "/queue")
    for name in places:
        add_step(tab, "Move joints").locator("select").select_option(label=name)
    mark = robot.record(lambda record: record.mark())
    tab.press("submit")
    expect(tab.page.locator("[data-ended] [data-job]").first).to_contain_text("2 of 2 steps")
    robot.require_rest()
    window = robot.record(lambda record: record.since(mark))
    assert window.low == pytest.approx(tuple(map(min, *places.values())), abs=1e-3)
    assert window.high == pytest.approx(tuple(map(max, *places.values())), abs=1e-3)
    assert robot.truth(lambda twin: twin.mechanics.true_joints()) == pytest.approx(places["right"], abs=1e-3)


TRUTH = replace(
    TrueConstants(),
    height=2.358,
    length=2.294,
    delta=0.304,
    counts_per_metre=1.002e6,
    switches=((0.010, 2.0 * pi / 3.0), (0.579, 2.262), (0.561, 2.298)),
)
"""A machine that is not built as its drawing says: its gripper is some 20 mm from where the robot believes it to be."""

TARGETS = (Joints(0.6, 1.35, 1.45), Joints(1.6, 1.45, 1.35))
"""Other places, which judge the calibration."""


@pytest.fixture
def crooked(tmp_path: Path) -> Iterator[TwinService]:
    """Return a robot whose machine differs from its configuration."""
    with twin_service(tmp_path, Options(FAST, homed=False, truth=TRUTH)) as made:
        yield made


def home(tab: Tab) -> None:
    """Home by the page Live."""
    visit(tab, "/")
    tab.press("home")
    tab.until("document.querySelector('[data-state].ok')", "it is homed")


def off(robot: TwinService, joints: Joints) -> float:
    """Go to a place; return the distance of the gripper from where the robot believes it to be [m]."""
    robot.ask("POST /v1/tasks", {"command": "move", "joints": joints})
    robot.until(lambda status: dist(status["state"]["joints"], joints) < NEAR)
    robot.require_rest()
    return dist(robot.state["point"], robot.gripper)


def test_calibrate(crooked: TwinService, tab_of: Callable[..., Tab]) -> None:
    """A person measures points, fits, looks at the map, saves, starts the service again, and homes."""
    tab = tab_of(crooked, worker=True)
    tab.forgive(*GONE)
    enter(tab)
    home(tab)
    visit(tab, "/workshop")
    tab.page.click(".tool[href$=calibration]")
    before: list[float] = []
    for row, joints in enumerate(MEASURED, 1):
        before.append(off(crooked, joints))
        for axis, value in zip("xyz", crooked.gripper, strict=True):
            tab.page.fill(f"[data-measured={axis}]", f"{value * 1e3:.2f}")
        tab.press("add-point")
        expect(tab.page.locator("[data-points] tbody tr")).to_have_count(row)
    last = tab.page.locator("[data-points] tbody tr").last
    row_number = last.locator("td").first.inner_text()
    last.locator("[data-remove-point]").click()
    expect(tab.page.locator("[data-points] [role=group]")).to_contain_text(f"row {row_number}?")
    tab.page.keyboard.press("Escape")
    expect(tab.page.locator("[data-points] tbody tr")).to_have_count(len(MEASURED))
    tab.press("fit")
    expect(tab.page.locator("[data-map] .arrow")).to_have_count(len(MEASURED))
    tab.press("apply")
    configuration = tab.page.locator("[data-tool=configuration]")
    expect(configuration).to_contain_text("geometry.delta")
    tab.press("save")
    expect(configuration.get_by_role("status")).to_contain_text("next start")
    crooked.kill()
    tab.until("document.querySelector('[data-lost]')")
    crooked.start()
    tab.until_live()
    home(tab)
    after = [off(crooked, joints) for joints in TARGETS]
    assert min(before) > 5e-3
    assert max(after) < 1e-3


SWITCHLESS = """
[axes.a]
switches = "none"
[axes.b]
switches = "none"
[axes.c]
switches = "none"
"""


@pytest.fixture
def switchless(tmp_path: Path) -> Iterator[TwinService]:
    """Return a robot that has no limit switches and is not homed."""
    text = CALM_FILE.read_text(encoding="utf-8") + SWITCHLESS
    (tmp_path / "maya.toml").write_text(text, encoding="utf-8")
    with twin_service(tmp_path, Options(FAST, homed=False)) as made:
        yield made


def state_joints(tab: Tab, robot: TwinService) -> None:
    """Type the true joints into the form of the datum, as a person has measured them, and send them."""
    a, b, c = robot.truth(lambda twin: twin.mechanics.true_joints())
    for name, value in (("a", degrees(a)), ("b", b * 1e3), ("c", c * 1e3)):
        tab.page.fill(f"[data-stated={name}] input", f"{value:.2f}")
    tab.press("datum-declare")


def test_a_person_gives_the_datum_of_a_robot_without_switches(
    switchless: TwinService, tab_of: Callable[..., Tab]
) -> None:
    tab = tab_of(switchless)
    enter(tab)
    form = tab.page.locator("[data-datum]")
    expect(form).to_contain_text("Tell it where it stands.")
    before = switchless.truth(lambda twin: twin.mechanics.true_joints())
    form.locator("[data-datum-axis=b]").click()
    form.get_by_role("button", name="+10.0 mm").click()
    expect(form.locator("[data-datum-moved]")).to_be_visible()
    after = switchless.truth(lambda twin: twin.mechanics.true_joints())
    assert after == pytest.approx((before[0], before[1] + 0.010, before[2]), abs=1e-4)
    state_joints(tab, switchless)
    expect(form).to_contain_text("until a second pose confirms")
    assert dist(switchless.state["point"], switchless.gripper) < NEAR
    a, b, c = switchless.state["joints"]
    off(switchless, Joints(a + 0.1, b - 0.1, c - 0.15))
    state_joints(tab, switchless)
    expect(form).to_have_count(0)
    assert switchless.ask("GET /v1/datum")["confirmed"] is True


def test_a_job_asks_and_the_queue_names_what_the_next_one_would_fail_with(
    ready: TwinService, tab_of: Callable[..., Tab]
) -> None:
    tab = tab_of(ready)
    enter(tab)
    visit(tab, "/queue")
    asks = {"ask": {"question": "Which tray?", "choices": ["left", "right"]}}
    asking = ready.ask("POST /v1/jobs", {"name": "asks", "steps": [asks]})["id"]
    for name in ("picks", "picks again"):
        ready.ask("POST /v1/jobs", {"name": name, "steps": [{"pick": list(CUBE)}]})
    question = tab.page.locator("[data-question]")
    expect(question).to_contain_text("Which tray?")
    waiting = tab.page.locator("[data-waiting] [data-job]")
    expect(waiting.filter(has_text="picks again")).to_contain_text("As things are")
    expect(waiting.first).not_to_contain_text("As things are")
    ready.ask("POST /v1/queue/pause", {})
    visit(tab, "/")
    expect(question).to_contain_text("Which tray?")
    question.locator("[data-answer]", has_text="right").click()
    expect(question).to_have_count(0)
    ready.until(lambda report: report["state"] == "done", f"/v1/jobs/{asking}")
