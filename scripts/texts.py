"""Extracts the texts of the packages from the code, updates the Spanish catalogues, and compiles them.

These are texts: the first argument of `translate`, `marked` or `phrase`, the second of `reword`, the sentence `en` of a
class, a row of a table, a constant for a detail of an error that is a `Phrase`, the words that the type of a detail
lists, the title and first comment of an example, and the meaning of a setting. With --check it writes nothing and
returns 1 if a catalogue lacks a translation, holds an obsolete or fuzzy one, has other placeholders than the English
text, or is not compiled, and if the code makes a phrase that cannot be extracted.
"""

from __future__ import annotations

import ast
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from io import BytesIO
from pathlib import Path
from string import Formatter
from typing import Annotated, Any, get_args, get_origin, get_type_hints

from babel.messages.catalog import Catalog, Message
from babel.messages.mofile import write_mo
from babel.messages.pofile import read_po, write_po

from dmc41x3.i18n import LANGUAGES, PHRASE, Phrase, unformatted
from maya_un.config import Config
from maya_un.config.settings import sections, settings
from maya_un.errors import by_code
from maya_un.http.doctor.finding import Finding
from maya_un.process.spec.examples import EXAMPLES, title_and_description

SOURCE = Path(__file__).resolve().parent.parent / "src"
PACKAGES = {"dmc41x3": ("dmc41x3",), "maya_un": ("maya_un", "maya_ros")}
"""The catalogues, and the packages whose texts each contains. Errors of `maya_ros` are shown by `maya` too."""

_CALLS = {"translate": (0, 2), "marked": (0, 1), "reword": (1, None), "phrase": (0, None)}
"""Functions that take a text: the places of the text and of its context among the arguments."""

_TABLES = {"FindingText"}
"""Rows of tables: all of their arguments are texts."""


@dataclass(frozen=True)
class Text:
    """A text in English, the context that tells it from equal ones, and the file that it stands in."""

    english: str
    context: str
    file: str


class Translations(Catalog):
    """The texts of a package in another language. The header holds nothing that changes by itself."""

    @property
    def mime_headers(self) -> list[tuple[str, str]]:
        """The fields of the header."""
        return [("Language", str(self.locale)), ("Content-Type", "text/plain; charset=utf-8")]


def main(arguments: list[str]) -> int:
    """Update and compile, or check, every catalogue."""
    problems: list[str] = []
    for package in PACKAGES:
        template = extracted(package)
        problems += [] if "--check" not in arguments else hidden(package)
        for language in LANGUAGES[1:]:
            file = SOURCE / package / "locale" / language / "LC_MESSAGES" / f"{package}.po"
            if "--check" in arguments:
                found = [*differences(template, stored(file, language)), *stale(file, language)]
                problems += [f"{file.relative_to(SOURCE.parent)}: {problem}" for problem in found]
            else:
                update(file, template, language)
    print("\n".join([*problems, "run scripts/texts.py and translate what is new"] if problems else []), end="")
    return 1 if problems else 0


def update(file: Path, template: Catalog, language: str) -> None:
    """Take the texts of the code over into a catalogue, and compile it."""
    catalogue = stored(file, language)
    catalogue.update(template)
    file.parent.mkdir(parents=True, exist_ok=True)
    written = BytesIO()
    write_po(written, catalogue, width=110, include_lineno=False, ignore_obsolete=True)
    file.write_bytes(written.getvalue())
    file.with_suffix(".mo").write_bytes(compiled(catalogue))


def stored(file: Path, language: str) -> Translations:
    """Return the catalogue of a file, an empty one if there is no file."""
    catalogue = Translations(
        locale=language, charset="utf-8", fuzzy=False, header_comment=f"# The texts of {file.stem} in {language}."
    )
    if file.exists():
        with file.open("rb") as opened:
            for message in read_po(opened, locale=language):
                if message.id:
                    catalogue[message.id] = message
    return catalogue


def phrases(language: str = LANGUAGES[1]) -> dict[str, str]:
    """Return the phrases of all packages in a language by the English ones; `{name}` stands for a detail."""
    files = (SOURCE / package / "locale" / language / "LC_MESSAGES" / f"{package}.po" for package in PACKAGES)
    found = {str(one.id): str(one.string) for file in files for one in stored(file, language) if one.context == PHRASE}
    return {_bare(english): _bare(found[english]) for english in sorted(found) if found[english] != english}


def _bare(template: str) -> str:
    return unformatted(template).replace("{{", "{").replace("}}", "}")


def compiled(catalogue: Catalog) -> bytes:
    """Return a catalogue as the standard library's gettext reads it."""
    file = BytesIO()
    write_mo(file, catalogue)
    return file.getvalue()


def extracted(package: str) -> Catalog:
    """Return the texts of a package, each with the files that it stands in."""
    catalogue = Catalog(charset="utf-8")
    found = [text for folder in PACKAGES[package] for text in texts(SOURCE / folder)]
    for text in [*found, *detail_words(package), *example_texts(package), *config_texts(package)]:
        catalogue.add(text.english, context=text.context or None, locations=[(text.file, 1)])
    return catalogue


def texts(folder: Path) -> Iterator[Text]:
    """Yield the texts in the Python files of a folder."""
    for file, tree in _trees(folder):
        for node in ast.walk(tree):
            if isinstance(node, ast.Call):
                yield from _of_call(node, file)
            elif isinstance(node, ast.ClassDef):
                sentences = [_constant(keyword.value) for keyword in node.keywords if keyword.arg == "en"]
                yield from (Text(english, "", file) for english in sentences if english)


def _trees(folder: Path) -> Iterator[tuple[str, ast.Module]]:
    for path in sorted(folder.rglob("*.py")):
        yield path.relative_to(SOURCE).as_posix(), ast.parse(path.read_text(encoding="utf-8"))


def _of_call(call: ast.Call, file: str) -> Iterator[Text]:
    name = _name(call)
    if name in _TABLES:
        yield from (Text(english, "", file) for english in map(_constant, call.args) if english)
    for given in _phrases(call):
        yield from (Text(english, PHRASE, file) for english in _alternatives(given) if english)
    if name not in _CALLS:
        return
    at, context_at = _CALLS[name]
    given = dict(enumerate(call.args))
    named = {keyword.arg: keyword.value for keyword in call.keywords}
    context = named.get("context", given.get(-1 if context_at is None else context_at))
    shown = PHRASE if name == "phrase" or _is_name(context, "PHRASE") else _constant(context)
    found = (Text(english, shown, file) for english in _alternatives(given.get(at)) if english)
    yield from (text for text in found if shown != PHRASE or _has_words(text.english))


def _name(call: ast.Call) -> str:
    return call.func.attr if isinstance(call.func, ast.Attribute) else getattr(call.func, "id", "")


def _is_name(node: ast.expr | None, name: str) -> bool:
    return isinstance(node, ast.Name) and node.id == name


def _has_words(template: str) -> bool:
    """Return whether a template has words of its own, which "{name}: {reason}" has not."""
    return any(character.isalpha() for text, *_ in Formatter().parse(template) for character in text)


def _phrases(call: ast.Call) -> list[ast.expr]:
    """Return the details in a call that makes an error, of those that are always phrases."""
    wanted = _phrase_details().get(_name(call), frozenset())
    return [keyword.value for keyword in call.keywords if keyword.arg in wanted]


@cache
def _phrase_details() -> dict[str, frozenset[str]]:
    """Return, by the names of errors, the details that are phrases and may not be any other text."""
    kinds = {kind: get_type_hints(kind, include_extras=True) for kind in by_code().values()}
    return {
        kind.__name__: frozenset(name for name in kind.declared if _is_phrase(hints[name]))
        for kind, hints in kinds.items()
    }


def _is_phrase(kind: Any) -> bool:
    kinds = {kind, *get_args(kind)} if get_origin(kind) is not Annotated else {kind}
    return Phrase in kinds and not {str, object} & kinds


def _alternatives(node: ast.expr | None) -> list[str]:
    """Return the texts of an argument: a constant, or those of a condition or of an `or`."""
    return [_constant(one) for one in _branches(node)]


def _branches(node: ast.expr | None) -> list[ast.expr | None]:
    match node:
        case ast.IfExp(body=body, orelse=other):
            return [*_branches(body), *_branches(other)]
        case ast.BoolOp(values=values):
            return [one for value in values for one in _branches(value)]
        case _:
            return [node]


def _constant(node: ast.expr | None) -> str:
    return node.value if isinstance(node, ast.Constant) and isinstance(node.value, str) else ""


def hidden(package: str) -> list[str]:
    """Return the places in the code that make a phrase which cannot be extracted."""
    trees = [one for folder in PACKAGES[package] for one in _trees(SOURCE / folder)]
    return [problem for file, tree in trees for problem in hidden_in(tree, file)]


def hidden_in(tree: ast.Module, file: str) -> Iterator[str]:
    """Yield why phrases of a file cannot be extracted: a formatted text, or one that comes by a plain variable."""
    for scope in ast.walk(tree):
        if not isinstance(scope, ast.Module | ast.FunctionDef | ast.AsyncFunctionDef):
            continue
        plain = _plain_texts(scope)
        for node in _own(scope):
            if isinstance(node, ast.Call):
                yield from (f"{file}:{node.lineno}: {problem}" for problem in _hidden(node, plain))


def _hidden(call: ast.Call, plain: set[str]) -> Iterator[str]:
    for node in (one for given in _phrases(call) for one in _branches(given)):
        if isinstance(node, ast.JoinedStr) and _is_worded(node):
            yield f'{ast.unparse(node)} cannot be translated: write phrase("... {{name}}", name=...)'
        elif "{" in _constant(node):
            yield f"{_constant(node)!r} has a brace: write phrase(...), and double the brace"
        elif isinstance(node, ast.Name) and node.id in plain:
            yield f"{node.id} is a plain text: write phrase(...) where it is made"
    if _name(call) == "phrase" and isinstance(call.func, ast.Name):
        template = _constant(call.args[0]) if call.args else ""
        given = {keyword.arg for keyword in call.keywords}
        if not template:
            yield f"{ast.unparse(call)} has no constant template"
        elif {name for name, _, _ in placeholders(template)} != given:
            yield f"{template!r} has other placeholders than the arguments {sorted(map(str, given))}"


def _own(scope: ast.AST) -> Iterator[ast.AST]:
    """Yield the nodes of a module or function, without those of the functions within it."""
    for node in ast.iter_child_nodes(scope):
        if not isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            yield node
            yield from _own(node)


def _plain_texts(scope: ast.AST) -> set[str]:
    """Return the variables to which a constant or formatted text of several words is assigned."""
    found = set[str]()
    for node in _own(scope):
        if isinstance(node, ast.Assign | ast.AnnAssign):
            targets = node.targets if isinstance(node, ast.Assign) else [node.target]
            if any(_is_worded(one) for one in _branches(node.value)):
                found |= {target.id for target in targets if isinstance(target, ast.Name)}
    return found


def _is_worded(node: ast.expr | None) -> bool:
    """Return whether a node is a text of several words, or a formatted text with words of its own."""
    if isinstance(node, ast.JoinedStr):
        return any(character.isalpha() for part in node.values for character in _constant(part))
    return " " in _constant(node)


def detail_words(package: str) -> Iterator[Text]:
    """Yield the words that details of errors are chosen from, which their types list, and the names of checks."""
    for declared in (*by_code().values(), Finding):
        if declared.__module__.partition(".")[0] in PACKAGES[package]:
            file = declared.__module__.replace(".", "/") + ".py"
            for name, kind in get_type_hints(declared).items():
                yield from (Text(word, f"{declared.__name__}.{name}", file) for word in _words(kind))


def example_texts(package: str) -> Iterator[Text]:
    """Yield the titles and descriptions of the example jobs of a package."""
    for path in sorted((SOURCE / package / EXAMPLES.name).glob("*.yaml")):
        file = path.relative_to(SOURCE).as_posix()
        yield from (Text(english, "", file) for english in title_and_description(path))


def config_texts(package: str) -> Iterator[Text]:
    """Yield the meanings of the sections and settings of the configuration of Maya."""
    if package == Config.__module__.partition(".")[0]:
        file = Config.__module__.replace(".", "/") + ".py"
        yield from (Text(one.meaning, "", file) for one in (*sections(), *settings()))


def _words(kind: Any) -> list[str]:
    return [word for part in get_args(kind) for word in ([part] if isinstance(part, str) else _words(part))]


def differences(template: Catalog, catalogue: Catalog) -> Iterator[str]:
    """Yield how a catalogue differs from the texts of the code."""
    english = {_key(message): message for message in template if message.id}
    translated = {_key(message): message for message in catalogue if message.id}
    yield from (f"obsolete: {text!r}" for _, text in translated.keys() - english.keys())
    for key in english:
        message = translated.get(key)
        if message is None or not message.string:
            yield f"not translated: {key[1]!r}"
        elif message.fuzzy:
            yield f"fuzzy: {key[1]!r}"
        elif placeholders(str(message.string)) != placeholders(key[1]):
            yield f"other placeholders than in English: {message.string!r}"


def _key(message: Message) -> tuple[str, str]:
    return message.context or "", str(message.id)


def placeholders(text: str) -> set[tuple[str, str | None, str | None]]:
    """Return the placeholders of a text with their formats."""
    return {(name, form, turned) for _, name, form, turned in Formatter().parse(text) if name is not None}


def stale(file: Path, language: str) -> Iterator[str]:
    """Yield a problem if the compiled catalogue is not that of the file."""
    binary = file.with_suffix(".mo")
    if not binary.exists() or binary.read_bytes() != compiled(stored(file, language)):
        yield "not compiled"


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
