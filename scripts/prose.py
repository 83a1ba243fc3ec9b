"""Checks the English of pages, docstrings, comments and messages: plain sentences, and the field's own words.

It checks the paths in its arguments, or without arguments those in `CHECKED`.
"""

from __future__ import annotations

import ast
import io
import re
import sys
import tokenize
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

from babel.messages.pofile import read_po

ROOT = Path(__file__).resolve().parent.parent

CHECKED = (
    "README.md", "CHANGELOG.md", "CONTRIBUTING.md",
    "benchmarks", "contrib", "docs", "examples", "ros", "ros2", "scripts", "src", "tests", "web/src", "web/test",
)  # fmt: skip
"""The files and folders that are checked. A folder stands for every file below it with an ending of `KINDS`."""

KINDS = {".md", ".po", ".py", ".ts", ".vue"}
"""Endings of the files that are checked: pages, catalogues of texts, and programs."""

WORDS = "web/src/words"
"""The folder whose strings are the texts of the dashboard. The other scripts have no texts, only comments."""

SKIPPED = ("docs/decisions/", "tests/goldens/", "web/src/generated/", "node_modules/")
"""Parts of paths that are not checked: records keep their words, and generated files are checked at their source."""

TURNED = re.compile(r"(What|Whatever|Who|Whoever|Whose|Where|Wherever|Quien|Quienes|Lo que|Donde)\b")
"""The words with which only a question may begin."""

RIDDLE = re.compile(r"(Be|It,|So (many|much|often|long))(?!\w)")
"""Beginnings of a docstring or a comment that leave the reader to guess its subject or its unit."""

RIDDLE_IN_TESTS = re.compile(r"(Come|Those)\b")
"""More of them in tests, whose helpers are seldom read together with what they stand in for."""

DIALECT = {
    r"wish(es|ed|ing)?": "command or request",
    r"floors?": "layer",
    r"doors?": "service, interface or listener",
    r"rooms": "packages or layers",
    r"(the|our|this|every) house": "system, project or host",
    r"tower": "stack",
    r"shelf|shelves": "recording store",
    r"stairs": "segmentation",
    r"lookouts?": "fault monitor",
    r"desks?": "exclusive slot",
    r"crossers?": "transfer planner",
    r"anew": "again",
    r"may everything": "has full access",
}
"""Words of a dialect of our own, as regular expressions, and the words of the field for them."""

_DIALECT = {re.compile(rf"\b({word})\b", re.IGNORECASE): repair for word, repair in DIALECT.items()}
_SENTENCE = re.compile(r"(?<=[.!?:])[\"”’)*_]*\s+(?=[\"“‘(*_¿]*[A-ZÁÉÍÓÚ`0-9])")
_CODE = re.compile(r"(^|\n)\s*(from [\w.]+ import|def \w+\(|return )")
"""A string with one of these is source code, as generators hold it."""

_MIN_WORDS = 3


@dataclass(frozen=True, slots=True)
class Text:
    """A paragraph of prose, and the line where it begins."""

    line: int
    words: str
    title: bool = False


@dataclass(frozen=True, slots=True)
class Finding:
    """A sentence that breaks a rule: where it stands, how it begins, and how to repair it."""

    path: Path
    line: int
    start: str
    repair: str

    def __str__(self) -> str:
        """Return one line as compilers write it."""
        return f'{self.path}:{self.line}: "{self.start}": {self.repair}'


def main(arguments: list[str]) -> int:
    """Check `CHECKED`, or the paths in `arguments`; return 1 if a sentence breaks a rule or a path is not there."""
    wanted = arguments or list(CHECKED)
    lost = [name for name in wanted if not (ROOT / name).exists()]
    for name in lost:
        print(f"{name} is not there: correct CHECKED in scripts/prose.py")
    found = [finding for path in sorted({*_files(wanted)}) for finding in check(path, path.read_text(encoding="utf-8"))]
    for finding in found:
        print(finding)
    if found:
        print(f"{len(found)} sentences to rewrite")
    return 1 if found or lost else 0


def check(path: Path, text: str) -> Iterator[Finding]:
    """Yield the sentences of a file that break a rule; the ending of `path` tells pages from programs."""
    shown = path.relative_to(ROOT) if path.is_relative_to(ROOT) else path
    for part in _parts(shown, text):
        for sentence in _SENTENCE.split(part.words):
            bare = sentence.strip().lstrip("\"“‘'(*_- ")
            repairs = [*_broken(bare, title=part.title), *_guessed(shown, bare)]
            yield from (Finding(shown, part.line, bare[:60], repair) for repair in repairs)


def _parts(path: Path, text: str) -> Iterator[Text]:
    if path.suffix == ".po":
        return _translations(text)
    if path.suffix == ".py":
        return _python(text, strings=not path.is_relative_to("tests"))
    if path.suffix in {".ts", ".vue"}:
        return _script(text, strings=path.is_relative_to(WORDS))
    return _page(path, text)


def _translations(text: str) -> Iterator[Text]:
    """Yield the texts of a catalogue in both languages."""
    for message in read_po(io.BytesIO(text.encode())):
        if message.id:
            yield from _paragraphs(message.lineno or 0, str(message.id))
            yield from _paragraphs(message.lineno or 0, str(message.string))


def _broken(sentence: str, *, title: bool) -> Iterator[str]:
    turned = TURNED.match(sentence)
    if turned and not title and not sentence.rstrip("\"”’'.)*_ ").endswith("?"):
        yield f"put the subject first instead of `{turned[0]}`: who or what acts, then what it does"
    for word, repair in _DIALECT.items():
        if found := word.search(sentence):
            yield f"`{found[0]}` is a word of our own: write {repair}"


def _guessed(path: Path, sentence: str) -> Iterator[str]:
    if path.suffix in {".md", ".po"}:
        return
    found = RIDDLE.match(sentence) or (RIDDLE_IN_TESTS.match(sentence) if path.is_relative_to("tests") else None)
    if found:
        yield f"say directly what `{found[0]}` stands for: who acts, or of what this is the number, size or time"


def _files(names: list[str]) -> Iterator[Path]:
    for name in names:
        path = ROOT / name
        below = [path] if path.is_file() else [one for one in path.rglob("*") if one.suffix in KINDS]
        yield from (one for one in below if not any(part in one.as_posix() for part in SKIPPED))


def _page(path: Path, text: str) -> Iterator[Text]:
    """Yield the paragraphs, list items, cells and titles of a page in Markdown, without code."""
    if path.name == "CHANGELOG.md":
        text = "\n## [".join(text.split("\n## [", 2)[:2])  # released versions keep their words
    code, begun, lines = False, 0, list[str]()
    for number, line in enumerate([*text.split("\n"), ""], 1):
        fence = line.lstrip().startswith("```")
        cell, title = line.lstrip().startswith("|"), line.startswith("#")
        item = re.match(r"\s*([-*]|\d+\.) ", line)
        if lines and (fence or cell or title or item or not line.strip()):
            yield Text(begun, _spoken(" ".join(lines)))
            lines = []
        code ^= fence
        if code or fence or line.startswith("<!--"):
            continue
        if cell or title:
            cells = re.split(r"(?<!\\)\|", line) if cell else [line.lstrip("# ")]
            yield from (Text(number, _spoken(one), title) for one in cells if one.strip())
        elif line.strip():
            begun = begun if lines else number
            lines.append(line[item.end() :] if item else line.strip())


def _python(text: str, *, strings: bool = True) -> Iterator[Text]:
    """Yield the docstrings and comments of a Python file, and its other `strings` of several words.

    Strings of tests are data: texts to parse, names of poses, words to find.
    """
    tree = ast.parse(text)
    inside = set[ast.AST]()
    for node in ast.walk(tree) if strings else _docstrings(tree):
        if node in inside:
            continue
        if isinstance(node, ast.JoinedStr):
            inside.update(node.values)
            parts = [str(one.value) if isinstance(one, ast.Constant) else "X" for one in node.values]
            yield from _paragraphs(node.lineno, "".join(parts))
        elif isinstance(node, ast.Constant) and isinstance(node.value, str):
            yield from _paragraphs(node.lineno, node.value)
    yield from _comments(text)


def _docstrings(tree: ast.Module) -> list[ast.Constant]:
    """Return the strings that are statements: docstrings, and the descriptions of constants."""
    statements = [node.value for node in ast.walk(tree) if isinstance(node, ast.Expr)]
    return [value for value in statements if isinstance(value, ast.Constant)]


def _paragraphs(line: int, string: str) -> Iterator[Text]:
    if len(string.split()) < _MIN_WORDS or _CODE.search(string):
        return
    for paragraph in re.split(r"(\n\s*\n)", string):
        if paragraph.strip():
            yield Text(line, _spoken(" ".join(paragraph.split())))
        line += paragraph.count("\n")


def _comments(text: str) -> Iterator[Text]:
    begun, last, lines = 0, 0, list[str]()
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        if token.type != tokenize.COMMENT:
            continue
        number, column = token.start
        alone = not token.line[:column].strip()
        if lines and not (alone and number == last + 1):
            yield Text(begun, _capital(" ".join(lines)))
            lines = []
        begun, last = begun if lines else number, number if alone else -1
        lines.append(token.string.lstrip("#! ").strip())
    if lines:
        yield Text(begun, _capital(" ".join(lines)))


_TOKEN = re.compile(
    r"""(?P<string>"(?:\\.|[^"\\\n])*"|'(?:\\.|[^'\\\n])*'|`(?:\\.|[^`\\])*`)"""
    r"""|(?P<line>(?:(?<=\n)[ ]*//[^\n]*\n)+|//[^\n]*)|/\*(?P<block>.*?)\*/|<!--(?P<page>.*?)-->""",
    re.DOTALL,
)
"""A string or a comment of TypeScript or of a Vue component. Comment lines that follow each other are one comment."""


def _script(text: str, *, strings: bool) -> Iterator[Text]:
    """Yield the comments of a script in TypeScript or Vue, and its `strings`."""
    for found in _TOKEN.finditer(text):
        line = text.count("\n", 0, found.start()) + 1
        if found["string"] is None:
            comment = re.sub(r"(?m)^\s*(//|\*+)", "", found["line"] or found["block"] or found["page"])
            for paragraph in _paragraphs(line, re.sub(r"\s*@\w+", "\n\n", comment)):
                yield Text(paragraph.line, _capital(paragraph.words))
        elif strings:
            for paragraph in _paragraphs(line, found["string"][1:-1]):
                label = not paragraph.words.endswith((".", "!", ":"))
                yield replace(paragraph, title=label)


def _capital(comment: str) -> str:
    """Return a comment with a capital, since a comment may begin small."""
    return _spoken(comment[:1].upper() + comment[1:])


def _spoken(text: str) -> str:
    """Return a text without its code and the addresses of its links."""
    text = re.sub(r"``.*?``|`[^`]*`|\{[^{}]*\}|\"\w+\":", "`X`", text)
    return re.sub(r"!?\[([^]]*)\]\([^)]*\)", r"\1", text).strip()


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
