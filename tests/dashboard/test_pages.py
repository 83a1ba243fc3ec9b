"""Every page in every language, size and theme."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from playwright.sync_api import expect

from maya_un.dashboard.pages import PAGES
from maya_un.errors import NotHomed
from tests.campaign import Campaign
from tests.dashboard.services import PASSWORD, Service
from tests.dashboard.tabs import LANGUAGES, SIZES, THEMES, Tab, stop_in_sight
from tests.secrecy import secret
from tests.waiting import eventually

HEADINGS = "[...document.querySelectorAll('main h1, main h2, main h3, main h4')].map((one) => Number(one.tagName[1]))"


def test_a_page_is_whole_in_every_language_size_and_theme(
    robot_service: Service, tab_of: Callable[..., Tab], campaign: Campaign
) -> None:
    """The page keeps language and theme over a reload. `./test --long` combines both themes with both languages."""
    tab = tab_of(robot_service)
    tab.open("/")
    looks = [(language, theme) for language in LANGUAGES for theme in THEMES]
    for number, path in enumerate(PAGES):
        (language, theme), *others = looks[number % len(looks) :] + looks[: number % len(looks)]
        if not campaign.long:
            others = [look for look in others if language not in look and theme not in look]
        tab.choose(language, theme)
        tab.open(path)
        require_whole(tab, path, language, theme, *SIZES)
        for look in others:
            new_language, new_theme = look[0] != language, look[1] != theme
            language, theme = look
            if new_language:
                tab.page.click(".rail [data-language]")
            if new_theme:
                tab.page.click(".rail button:has(+ [data-language])")
            require_whole(tab, path, language, theme, *(SIZES if new_language else ["desktop"]))


def require_whole(tab: Tab, path: str, language: str, theme: str, *sizes: str) -> None:
    """Fail unless the page has this language and theme, fits the sizes, and has no gaps in its texts."""
    assert tab.get("[document.documentElement.lang, document.documentElement.dataset.theme]") == [language, theme]
    for size in sizes:
        width, height = SIZES[size]
        tab.page.set_viewport_size({"width": width, "height": height})
        where = f"{path} {language} {theme} {size}"
        assert tab.get("document.documentElement.scrollWidth <= innerWidth"), f"{where} scrolls sideways"
        assert tab.get(HEADINGS).count(1) == 1, where
        stop_in_sight(tab)
        assert tab.get(r"document.body.innerText.match(/\{\w+\}|undefined|NaN|\[object/)") is None, where


def test_buttons_that_are_off_say_why(guarded: Service, tab_of: Callable[..., Tab]) -> None:
    guarded.refused("POST /v1/users", {"name": "vic", "role": "viewer", "password": secret("vic")})
    tab = tab_of(guarded)
    tab.page.goto(f"{guarded.url}/drive")
    tab.sign_in("vic", secret("vic"))
    for name in ("home", "gripper", "pause"):
        expect(tab.page.locator(f"[data-{name}] button")).to_have_attribute("aria-disabled", "true")
        expect(tab.page.locator(f"[data-{name}] [role=tooltip]")).to_contain_text("vic has the role viewer")
    tab.page.click("[data-pause]")
    expect(tab.page.locator("[data-pause] [role=tooltip]")).to_be_visible()


def test_the_code_for_a_phone_ends_with_its_window_and_with_the_page(
    guarded: Service, tab_of: Callable[..., Tab]
) -> None:
    def codes() -> int:
        return sum(one["note"] == CODE for one in guarded.ask("GET /v1/users/root/tokens"))

    tab = tab_of(guarded)
    tab.page.goto(f"{guarded.url}/people")
    tab.sign_in("root", PASSWORD)
    for leave in (lambda: tab.page.keyboard.press("Escape"), lambda: tab.page.goto("about:blank")):
        tab.page.click("[data-phone]")
        tab.page.click("[data-show-code]")
        expect(tab.page.locator("[data-phone-dialog] svg[role=img]")).to_be_visible()
        assert codes() == 1
        leave()
        eventually(lambda: codes() == 0, "the end of the code")


CODE = "code for a phone"
"""The note of the token of a code that no phone has read."""


FORBIDDEN = """for (const name of ['localStorage', 'sessionStorage'])
    Object.defineProperty(window, name, { get: () => { throw new DOMException('denied', 'SecurityError'); } })"""

FULL = """Storage.prototype.setItem = () => { throw new DOMException('full', 'QuotaExceededError'); }"""


@pytest.mark.parametrize("storage", [FORBIDDEN, FULL], ids=["forbidden", "full"])
def test_page_works_without_storage(robot_service: Service, tab_of: Callable[..., Tab], storage: str) -> None:
    tab = tab_of(robot_service)
    tab.page.add_init_script(storage)
    tab.open("/drive")
    stop_in_sight(tab)
    tab.page.click(".rail [data-language]")
    tab.page.click(".rail button:has(+ [data-language])")
    assert tab.get("[document.documentElement.lang, document.documentElement.dataset.theme]") == ["es", "light"]


def test_a_text_of_the_service_is_in_the_language_of_the_page(furnished: Service, tab_of: Callable[..., Tab]) -> None:
    """It does not matter which language the browser prefers, nor which one the page had before."""
    tab = tab_of(furnished, locale="es")
    tab.open("/history")
    for language in ("es", "en", "es"):
        expect(tab.page.locator("[data-why]")).to_have_text(NotHomed(command="maya home").text(language))
        tab.page.click(".rail [data-language]")


SLOW_JOB = {"name": "sort", "steps": [{"move": [1.2 if n % 2 else 0.2, 1.5, 1.5]} for n in range(8)]}
"""A job with more steps than the page Live shows."""

OVER_A_CHIP = """() => {
    const boxOf = (one) => one.getBoundingClientRect();
    const [view, scale] = ['.scene', '[data-scale]'].map((one) => boxOf(document.querySelector(one)));
    const beside = (one) => one.left >= scale.right || one.right <= scale.left;
    const over = (one) => !beside(one) && one.top < scale.bottom && one.bottom > scale.top;
    const chips = [...document.querySelectorAll('.scene .chip')].map(boxOf);
    return scale.top < view.top + view.height / 2 || chips.some(over);
}"""
"""Tells whether the scale of the tension lies in the upper half of the 3D view, where the boom is, or over a button."""


@pytest.mark.parametrize("language", LANGUAGES)
def test_live_of_a_running_job_fits_the_screen(robot: Service, tab_of: Callable[..., Tab], language: str) -> None:
    """A desktop does not scroll, a tablet shows all of Stop, and on a phone the scale is not over the boom."""
    robot.ask("POST /v1/speed", {"ratio": 0.05})
    robot.ask("POST /v1/jobs", SLOW_JOB)
    tab = tab_of(robot, locale=language)
    tab.open("/")
    tab.until(
        "document.querySelectorAll('[data-motion] .steps li').length === 5 && document.querySelector('[data-plot]')"
    )
    tab.until("document.documentElement.scrollHeight === innerHeight", "the page does not scroll")
    for size in ("tablet", "phone"):
        width, height = SIZES[size]
        tab.page.set_viewport_size({"width": width, "height": height})
        stop_in_sight(tab)
    tab.until("document.querySelector('[data-scale]')")
    assert not tab.get(OVER_A_CHIP)
