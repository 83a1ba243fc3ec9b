"""Translate texts: the code contains English, and a catalogue of each package the other languages.

The catalogue of Spanish is `locale/es/LC_MESSAGES/<package>.po`; `scripts/texts.py` extracts the texts from the code,
and compiles the catalogue to the `.mo` beside it, which the standard library's `gettext` reads. The language is an
argument of each request. English needs neither a catalogue nor gettext.
"""

from __future__ import annotations

import sys
from functools import cache
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from gettext import NullTranslations

LANGUAGES = ("en", "es")
"""The language of the code, then those that have a catalogue."""

_packages = ["dmc41x3"]


def add_catalogue(package: str) -> None:
    """Look for translations in the catalogue of `package` too, before those that were added earlier."""
    if package not in _packages:
        _packages.append(package)


def translate(text: str, language: str, context: str = "", /, **details: object) -> str:
    """Return an English text in `language`, with its details filled in; an unknown language gives English.

    Without details the placeholders stay. A `context` distinguishes texts that are equal only in English.
    """
    if language != "en" and language in LANGUAGES and text:
        catalogue = _catalogue(language, tuple(_packages))
        text = catalogue.pgettext(context, text) if context else catalogue.gettext(text)
    return text.format(**details) if details else text


def translations(text: str) -> dict[str, str]:
    """Return an English text in every language, by the name of the language."""
    return {language: translate(text, language) for language in LANGUAGES}


def marked(text: str, context: str = "") -> str:  # scripts/texts.py reads the context
    """Return an English text that is translated where it is used, so that `scripts/texts.py` finds it here."""
    return text


@cache
def _catalogue(language: str, packages: tuple[str, ...]) -> NullTranslations:
    """Return the catalogues of the packages, the newest package first; without those that are missing or damaged.

    Texts are looked up while an error is reported or the robot is stopped, so a missing catalogue must not raise.
    """
    from gettext import NullTranslations, translation  # noqa: PLC0415  # a program in English starts without it

    found: NullTranslations | None = None
    for package in packages:
        try:
            newest = translation(package, f"{sys.modules[package].__path__[0]}/locale", [language])
        except Exception:  # noqa: BLE001  # a damaged file ends the reader with errors of many kinds
            continue
        if found is not None:
            newest.add_fallback(found)
        found = newest
    return found or NullTranslations()
