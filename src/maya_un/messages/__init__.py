"""The sentences of errors by code, one module for each language.

Each entry has one or two plain sentences: the
event, its cause, the remedy. `{name}` stands for a detail of the error.
"""

from __future__ import annotations

from importlib import import_module
from typing import cast

LANGUAGES = ("en", "es")


class _Missing(dict[str, object]):
    """Leaves a placeholder readable instead of failing while an error is being reported."""

    def __missing__(self, key: str) -> str:
        return f"<{key}>"


def table(language: str = "en") -> dict[int, str]:
    """Return all sentences of a language by code; an unknown language gives English."""
    name = language if language in LANGUAGES else "en"
    return cast("dict[int, str]", import_module(f"maya_un.messages.{name}").SENTENCES)


def sentence(code: int, details: dict[str, object], language: str = "en") -> str:
    """Return the sentence of `code` with its details filled in; details in `WORDS` are translated to `language`."""
    words = _words(language).get(code, {})
    shown = {key: words.get(key, {}).get(str(value), value) for key, value in details.items()}
    return table(language)[code].format_map(_Missing(shown))


def _words(language: str) -> dict[int, dict[str, dict[str, str]]]:
    """Return the translations of details by code and name; other details stay unchanged."""
    name = language if language in LANGUAGES else "en"
    return cast("dict[int, dict[str, dict[str, str]]]", getattr(import_module(f"maya_un.messages.{name}"), "WORDS", {}))
