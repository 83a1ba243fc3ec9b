"""Every page in every language, size and theme."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

from maya_un.dashboard.pages import PAGES
from tests.conventions.source import ROOT
from tests.dashboard.services import Service
from tests.dashboard.tabs import LANGUAGES, SIZES, THEMES, Tab, stop_in_sight

AXE = ROOT / "web" / "node_modules" / "axe-core" / "axe.min.js"
RULES = ["wcag2a", "wcag2aa", "wcag21a", "wcag21aa", "wcag22aa"]

HEADINGS = "[...document.querySelectorAll('main h1, main h2, main h3, main h4')].map((one) => Number(one.tagName[1]))"


@pytest.mark.parametrize("path", PAGES)
def test_a_page_is_whole_in_every_language_size_and_theme(
    robot_service: Service, tab_of: Callable[..., Tab], path: str
) -> None:
    tab = tab_of(robot_service)
    tab.open(path)
    for language in LANGUAGES:
        for theme in THEMES:
            tab.choose(language, theme)
            tab.open(path)
            assert tab.get("[document.documentElement.lang, document.documentElement.dataset.theme]") == [
                language,
                theme,
            ]
            for size, (width, height) in SIZES.items():
                tab.page.set_viewport_size({"width": width, "height": height})
                where = f"{path} {language} {theme} {size}"
                assert tab.get("document.documentElement.scrollWidth <= innerWidth"), f"{where} scrolls sideways"
                assert tab.get(HEADINGS).count(1) == 1, where
                stop_in_sight(tab)
                assert tab.get(r"document.body.innerText.match(/\{\w+\}|undefined|NaN|\[object/)") is None, where


@pytest.mark.parametrize("path", PAGES)
def test_a_page_is_usable_for_everybody(robot_service: Service, tab_of: Callable[..., Tab], path: str) -> None:
    tab = tab_of(robot_service, bypass_csp=True)
    tab.open(path)
    for theme in THEMES:
        tab.choose("en", theme)
        tab.open(path)
        assert violations(tab) == [], f"{path} {theme}"


def violations(tab: Tab) -> list[str]:
    """Return what axe finds against the guidelines for accessible pages."""
    tab.page.evaluate(AXE.read_text(encoding="utf-8"))
    found: list[dict[str, Any]] = tab.page.evaluate(
        "async (tags) => (await axe.run(document, { runOnly: tags, resultTypes: ['violations'] })).violations", RULES
    )
    return [f"{one['id']}: {node['html']}" for one in found for node in one["nodes"]]
