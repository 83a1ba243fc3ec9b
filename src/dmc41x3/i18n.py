"""Translate texts: the code contains English, and a catalogue of each package the other languages.

The catalogue of Spanish is `locale/es/LC_MESSAGES/<package>.po`; `scripts/texts.py` extracts the texts from the code,
and compiles the catalogue to the `.mo` beside it, which the standard library's `gettext` reads. The language is an
argument of each request. English needs neither a catalogue nor gettext.

A phrase is a part of a sentence, for example the reason in "point = 2 is not valid: it must be a text". Most phrases
reach their reader as English text, over JSON, ROS or the journal. So `translate_phrase` finds a phrase by its text.
"""

from __future__ import annotations

import re
import sys
from functools import cache, lru_cache
from typing import TYPE_CHECKING, Annotated, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence
    from gettext import NullTranslations

LANGUAGES = ("en", "es")
"""The language of the code, then those that have a catalogue."""

PHRASE = "phrase"
"""The context of phrases in the catalogues."""

Phrase = Annotated[str, PHRASE]
"""The type of a detail of an error that is a phrase. `scripts/texts.py` extracts the texts that it is given."""

_packages = ["dmc41x3"]
_sentences: dict[str, str] = {}


def add_catalogue(package: str) -> None:
    """Look for translations in the catalogue of `package` too, before those that were added earlier."""
    if package not in _packages:
        _packages.append(package)


def add_sentence(template: str, context: str) -> None:
    """Let `translate_phrase` find a sentence in a phrase, as the message of an error in the reason of another one.

    A word for the detail NAME has the context "CONTEXT.NAME" in the catalogue.
    """
    _sentences[template] = context
    _templates.cache_clear()
    _found.cache_clear()


def translate(text: str, language: str, context: str = "", /, **details: object) -> str:
    """Return an English text in `language`, with its details filled in; an unknown language gives English.

    Without details the placeholders stay. A `context` distinguishes texts that are equal only in English.
    """
    if language != "en" and language in LANGUAGES and text:
        catalogue = _catalogues(language, tuple(_packages))[0]
        text = catalogue.pgettext(context, text) if context else catalogue.gettext(text)
    return text.format(**details) if details else text


def translations(text: str) -> dict[str, str]:
    """Return an English text in every language, by the name of the language."""
    return {language: translate(text, language) for language in LANGUAGES}


def marked(text: str, context: str = "") -> str:  # scripts/texts.py reads the context
    """Return an English text that is translated where it is used, so that `scripts/texts.py` finds it here."""
    return text


def phrase(template: str, /, **details: object) -> str:
    """Return a phrase in English, with its details filled in. `translate_phrase` translates it where it is shown.

    Details may be phrases too. A brace of the text itself is doubled, also without details.
    """
    return template.format(**details)


_CONJUNCTIONS = (marked(" and ", PHRASE), marked(" or ", PHRASE))


class _Translation(NamedTuple):
    """A translated text, and the number of its characters that stay as they are."""

    text: str
    left: int


class _Template(NamedTuple):
    """A text with placeholders, and its translation.

    The word that fills the placeholder NAME is translated with the gettext context `context`.NAME.
    """

    english: str
    translation: str
    context: str = PHRASE


_LONGEST = 1000
"""Texts with more characters are no phrases; the search in them would take long."""

_DEEPEST = 4
"""Phrases that stand in each other more often than this stay as they are."""


def translate_phrase(text: str, language: str) -> str:
    """Return a phrase in `language`, and any other text unchanged.

    The details are translated too if they are phrases. Phrases in a list ("angles and heights"), one behind a name
    ("grid: it is too small") and sentences of errors are also found. If several templates match, that one is taken
    which leaves the fewest characters untranslated.
    """
    if language == "en" or language not in LANGUAGES:
        return text
    return _found(text, language, tuple(_packages), _DEEPEST)[0]


@lru_cache(maxsize=1024)
def _found(text: str, language: str, packages: tuple[str, ...], depth: int) -> _Translation:
    phrases = _phrases(language, packages)
    if text in phrases:
        return _Translation(phrases[text], 0)
    stays = _Translation(text, len(text))
    if depth == 0 or len(text) > _LONGEST:
        return stays

    def part(one: str) -> _Translation:
        return _found(one, language, packages, depth - 1)

    ways = (*_joined(text, phrases, part), *_filled(text, _templates(language, packages), language, part), stays)
    return min(ways, key=lambda way: way.left)


def _joined(text: str, phrases: Mapping[str, str], part: Callable[[str], _Translation]) -> Iterator[_Translation]:
    """Yield the translations of a list of phrases, and of a phrase behind a name."""
    parts = re.split(f"({'|'.join((', ', *_CONJUNCTIONS))})", text)
    if all(one in phrases for one in parts[::2]):
        yield _Translation("".join(phrases.get(one, one) for one in parts), 0)
    before, colon, behind = text.partition(": ")
    if colon:
        name, phrase = part(before), part(behind)
        yield _Translation(name.text + colon + phrase.text, name.left + phrase.left)


def _filled(
    text: str, templates: Sequence[_Template], language: str, part: Callable[[str], _Translation]
) -> Iterator[_Translation]:
    """Yield the translations by the templates that match a text, that of the most exact one first."""
    for template in templates:
        details = details_in(text, template.english)
        if details is not None:
            words = {name: _word(one, language, f"{template.context}.{name}") for name, one in details.items()}
            shown = {name: words[name] or part(one) for name, one in details.items()}
            texts = {name: one.text for name, one in shown.items()}
            yield _Translation(template.translation.format(**texts), sum(one.left for one in shown.values()))


def _word(text: str, language: str, context: str) -> _Translation | None:
    word = translate(text, language, context)
    return None if word == text else _Translation(word, 0)


def details_in(text: str, template: str) -> dict[str, str] | None:
    """Return the details of a text of this template by name, None for any other text."""
    piece, pattern = _pattern(template)
    found = pattern().fullmatch(text) if piece in text else None
    return None if found is None else found.groupdict()


def unformatted(template: str) -> str:
    """Return a template without the formats of its details, because details that were found in a text are texts."""
    pieces = ((text.replace("{", "{{").replace("}", "}}"), name) for text, name, _ in _pieces(template))
    return "".join(text + (f"{{{name}}}" if name else "") for text, name in pieces)


@cache
def _pattern(template: str) -> tuple[str, Callable[[], re.Pattern[str]]]:
    """Return the longest piece of a template, and a function that compiles the pattern of its texts once.

    Most texts do not contain the piece, so that most patterns are never compiled.
    """
    pieces = _pieces(template)

    @cache
    def compiled() -> re.Pattern[str]:
        parts, seen = [""], set[str]()
        for text, name, is_number in pieces:
            parts[-1] += re.escape(text)
            if name in seen:
                parts[-1] += f"(?P={name})"
            elif name and is_number:
                parts[-1] += f"(?P<{name}>{_NUMBER})"
            elif name:
                parts.append(f"(?P<{name}>.*?)")
            seen.add(name or "")
        # An atomic part takes the first place where it fits, so that the time grows linearly with the text.
        *first, last = parts
        return re.compile("".join(f"(?>{one})" for one in first) + last, re.DOTALL)

    return max((text for text, *_ in pieces), key=len), compiled


_NUMBER = r"[-+]?(?:[\d.]+(?:e[-+]?\d+)?|inf|nan)%?"


def _pieces(template: str) -> list[tuple[str, str | None, bool]]:
    """Return the texts of a template, each with the detail that follows it: its name, and whether it is a number."""
    from string import Formatter  # noqa: PLC0415  # it compiles patterns of its own, and is seldom needed

    found = Formatter().parse(template)
    return [(text, name, (form or "").endswith(("d", "e", "f", "g", "%"))) for text, name, form, _ in found]


@cache
def _templates(language: str, packages: tuple[str, ...]) -> list[_Template]:
    """Return the phrases with details and the sentences, the most exact ones first."""
    found = [_Template(english, one) for english, one in _phrases(language, packages).items() if "{" in english]
    for english, context in _sentences.items():
        translation = translate(english, language)
        for end in ("", "."):  # a sentence in another one may lack its full stop
            found.append(_Template(english.removesuffix(end), translation.removesuffix(end), context))
    plain = [one._replace(translation=unformatted(one.translation)) for one in found]
    return sorted(plain, key=lambda one: _exactness(one.english), reverse=True)


def _exactness(template: str) -> tuple[bool, int]:
    """Return whether a template begins with a text, and the length of its texts."""
    pieces = [text for text, *_ in _pieces(template)]
    return bool(pieces[0]), sum(map(len, pieces))


@cache
def _phrases(language: str, packages: tuple[str, ...]) -> dict[str, str]:
    """Return the translation of each phrase."""
    found: dict[str, str] = {}
    for catalogue in reversed(_catalogues(language, packages)):
        for key, translation in vars(catalogue).get("_catalog", {}).items():  # an attribute that gettext documents
            context, _, english = str(key).partition("\x04")
            if context == PHRASE:
                found[english] = translation
    return found


@cache
def _catalogues(language: str, packages: tuple[str, ...]) -> list[NullTranslations]:
    """Return the catalogues of the packages, the newest package first; without those that are missing or damaged.

    Each falls back on those behind it. Texts are looked up while an error is reported or the robot is stopped, so a
    missing catalogue must not raise.
    """
    from gettext import NullTranslations, translation  # noqa: PLC0415  # a program in English starts without it

    found: list[NullTranslations] = []
    for package in packages:
        try:
            newest = translation(package, f"{sys.modules[package].__path__[0]}/locale", [language])
        except Exception:  # noqa: BLE001  # a damaged file ends the reader with errors of many kinds
            continue
        if found:
            newest.add_fallback(found[0])
        found.insert(0, newest)
    return found or [NullTranslations()]


_CONTROL = r"[\x00-\x08\x0b-\x1f\x7f-\x9f]"


def visible(text: str) -> str:
    r"""Return a text of another device with codes like \x1b for control characters, which a terminal would execute.

    Tabs and line feeds stay.
    """
    return re.sub(_CONTROL, lambda found: f"\\x{ord(found[0]):02x}", text)


def one_line(text: str) -> str:
    r"""Return a text of others as one line: also tabs and line feeds are codes like \x0a."""
    return visible(text).replace("\n", r"\x0a").replace("\t", r"\x09")
