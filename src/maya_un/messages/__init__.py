"""The words of the house, looked up by code: one module a language, nothing scattered.

Each entry is one or two plain sentences: what happened, why, what to do next. `{name}` stands for a detail of
the error.
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
    """Return all sentences of a language by code; an unknown language reads as English."""
    name = language if language in LANGUAGES else "en"
    return cast("dict[int, str]", import_module(f"maya_un.messages.{name}").SENTENCES)


def sentence(code: int, details: dict[str, object], language: str = "en") -> str:
    """Return the sentence of `code` with its details filled in; those that are words of ours are in `language` too."""
    words = _words(language).get(code, {})
    shown = {key: words.get(key, {}).get(str(value), value) for key, value in details.items()}
    return table(language)[code].format_map(_Missing(shown))


def _words(language: str) -> dict[int, dict[str, dict[str, str]]]:
    """Return what details are called in a language, by code and name; what does not stand there is said as it is."""
    name = language if language in LANGUAGES else "en"
    return cast("dict[int, dict[str, dict[str, str]]]", getattr(import_module(f"maya_un.messages.{name}"), "WORDS", {}))
