"""The sentences of errors, looked up by code: one module for each language.

Each entry is one or two plain sentences: what happened, why, what to do next. `{name}` stands for a detail of
the error. A package that is built on this one adds sentences of its own by `add_catalogue`.
"""

from __future__ import annotations

from functools import cache
from importlib import import_module
from typing import cast

LANGUAGES = ("en", "es")

_catalogues = [__name__]


class _Missing(dict[str, object]):
    """Leaves a placeholder readable instead of failing while an error is being reported."""

    def __missing__(self, key: str) -> str:
        return f"<{key}>"


def add_catalogue(package: str) -> None:
    """Use the sentences in the modules `en` and `es` of `package` too; they replace those of earlier catalogues.

    The modules are imported when a sentence is first needed.
    """
    if package not in _catalogues:
        _catalogues.append(package)


def table(language: str = "en") -> dict[int, str]:
    """Return all sentences of a language by code; an unknown language reads as English."""
    return _sentences(_known(language), tuple(_catalogues))


def sentence(code: int, details: dict[str, object], language: str = "en") -> str:
    """Return the sentence of `code` with its details filled in, and details that are our own words translated."""
    words = _words(_known(language), tuple(_catalogues)).get(code, {})
    shown = {key: words.get(key, {}).get(str(value), value) for key, value in details.items()}
    return table(language)[code].format_map(_Missing(shown))


def _known(language: str) -> str:
    return language if language in LANGUAGES else "en"


@cache
def _sentences(language: str, catalogues: tuple[str, ...]) -> dict[int, str]:
    """Return the sentences of the catalogues by code, in the order of codes."""
    found: dict[int, str] = {}
    for catalogue in catalogues:
        found.update(cast("dict[int, str]", import_module(f"{catalogue}.{language}").SENTENCES))
    return dict(sorted(found.items()))


@cache
def _words(language: str, catalogues: tuple[str, ...]) -> dict[int, dict[str, dict[str, str]]]:
    """Return the translations of details, by code and name of the detail."""
    found: dict[int, dict[str, dict[str, str]]] = {}
    for catalogue in catalogues:
        module = import_module(f"{catalogue}.{language}")
        found.update(cast("dict[int, dict[str, dict[str, str]]]", getattr(module, "WORDS", {})))
    return found
