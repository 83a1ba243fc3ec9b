"""Texts of `maya logs`, in every language."""

from __future__ import annotations

_WORDS: dict[str, tuple[str, str]] = {
    "nothing_kept": (
        "nothing has been stored there yet; `maya up` stores a log and a journal",
        "allí no se ha guardado nada todavía; `maya up` lleva un registro y un diario",
    ),
}


def word(key: str, language: str) -> str:
    """Return the words of `key` in `language`."""
    english, spanish = _WORDS[key]
    return spanish if language == "es" else english
