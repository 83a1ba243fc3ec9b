"""Read documents that users write: YAML or JSON. Nothing is executed, and nothing is silently dropped."""

from __future__ import annotations

import json
from collections.abc import Generator, Hashable, Iterator
from contextlib import contextmanager
from itertools import pairwise
from pathlib import Path
from reprlib import repr
from typing import Any, NamedTuple

import yaml
from yaml.composer import ComposerError
from yaml.constructor import ConstructorError
from yaml.scanner import ScannerError

from dmc41x3.files import read_bytes
from dmc41x3.i18n import phrase
from maya_un.errors import FileUnreadable, InvalidJob

MOST_BYTES = 250_000
"""Size of the largest file that is read."""


def read_document(path: Path) -> Any:
    """Return the data of a file (.json, anything else is read as YAML).

    Raises `FileUnreadable` for a file that cannot be read or parsed.
    """
    text = _text(path)
    try:
        return json.loads(text, object_pairs_hook=_unique_keys) if path.suffix == ".json" else yaml.load(text, _Loader)
    except (ValueError, yaml.YAMLError, RecursionError) as error:
        raise FileUnreadable(path=path, reason=_first_line(error)) from error


def _text(path: Path) -> str:
    try:
        return read_bytes(path, MOST_BYTES).decode("utf-8")
    except UnicodeDecodeError as error:
        raise FileUnreadable(path=path, reason="it is not UTF-8 text") from error


def _unique_keys(pairs: list[tuple[Any, Any]]) -> dict[Any, Any]:
    """Return pairs as a dict; raises `ValueError` for a key that occurs twice."""
    once: dict[Any, Any] = {}
    for key, value in pairs:
        _add(once, key, value)
    return once


def _add(once: dict[Any, Any], key: object, value: object) -> None:
    """Add a pair; raises `ValueError` for a key that `once` has, or that is no text or number."""
    if not isinstance(key, Hashable):
        raise ValueError(phrase("a key must be a text, not {key!r}", key=key))  # noqa: TRY004 - a parse error like the others
    if key in once:
        raise ValueError(phrase("the key {key!r} appears twice", key=key))
    once[key] = value


_DEEPEST = 50
"""Number of brackets in each other that are read; the parser takes minutes for thousands."""


_NUMBER_TAGS = ("tag:yaml.org,2002:int", "tag:yaml.org,2002:float")
_TEXT_TAG = "tag:yaml.org,2002:str"


class _Loader(yaml.SafeLoader):
    """Safe YAML, in which a repeated key, an alias and deep nesting are errors, and 12:30 is a text.

    YAML 1.1 reads 12:30 as a number to the base 60, here 750, which nobody means who writes a time.
    """

    def fetch_flow_collection_start(self, TokenClass: type[yaml.Token]) -> None:
        if self.flow_level >= _DEEPEST:
            raise ScannerError(None, None, phrase("it is nested too deeply"), self.get_mark())
        super().fetch_flow_collection_start(TokenClass)

    def resolve(self, kind: type[yaml.Node], value: Any, implicit: Any) -> str:
        tag: str = super().resolve(kind, value, implicit)
        base_60 = tag in _NUMBER_TAGS and isinstance(value, str) and ":" in value
        return _TEXT_TAG if base_60 else tag

    def construct_object(self, node: yaml.Node, deep: bool = False) -> Any:
        try:
            return super().construct_object(node, deep=deep)
        except (ValueError, LookupError, AttributeError, TypeError) as error:  # of PyYAML, for a tag like !!bool
            tag = node.tag.replace("tag:yaml.org,2002:", "!!")
            reason = phrase("{value} is no value of the type {tag}", value=repr(node.value), tag=tag)
            raise ConstructorError(None, None, reason, node.start_mark) from error

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Hashable, Any]:
        once: dict[Hashable, Any] = {}
        for key, value in node.value:
            try:
                _add(once, self.construct_object(key, deep=True), self.construct_object(value, deep=True))
            except ValueError as error:
                raise ConstructorError(None, None, str(error), key.start_mark) from error
        return once

    def compose_node(self, parent: yaml.Node | None, index: int) -> yaml.Node | None:
        if self.check_event(yaml.AliasEvent):
            raise ComposerError(None, None, phrase("aliases (*name) are not accepted"), self.peek_event().start_mark)
        return super().compose_node(parent, index)


class TextPlace(NamedTuple):
    """A place in a text: its line and column, counted from 1."""

    line: int
    column: int

    @classmethod
    def of(cls, mark: yaml.Mark) -> TextPlace:
        """Return the place of a mark of the YAML parser."""
        return cls(mark.line + 1, mark.column + 1)


class TextMistake(NamedTuple):
    """Why a text is not YAML, and where."""

    place: TextPlace
    reason: str


class YamlText:
    """The data of a YAML text, and the places of its parts."""

    def __init__(self, data: Any, root: yaml.Node | None) -> None:
        self.data = data
        self._root = root

    def place(self, key: str) -> TextPlace:
        """Return the place of the part with a dotted key, like `steps.2.pick`; of the nearest part around it."""
        node = self._root
        at = TextPlace(1, 1) if node is None else TextPlace.of(node.start_mark)
        for part in key.split("."):
            found = _child(node, part)
            if found is None:
                break
            mark, node = found
            at = TextPlace.of(mark)
        return at


def _child(node: yaml.Node | None, part: str) -> tuple[yaml.Mark, yaml.Node] | None:
    """Return the mark and the value of an entry: of a mapping at its key, of a list at its value."""
    if isinstance(node, yaml.MappingNode):
        return next(((key.start_mark, value) for key, value in node.value if key.value == part), None)
    if isinstance(node, yaml.SequenceNode) and part.isdecimal() and int(part) < len(node.value):
        value = node.value[int(part)]
        return value.start_mark, value
    return None


_EVENTS = 200


def read_yaml(text: str) -> Generator[None, None, YamlText | TextMistake]:
    """Return what a YAML text contains, or its first mistake; for a worker, since this takes a second for 100 kB."""
    try:
        events = _Loader(text)
        parsed: list[yaml.Event] = []
        while events.check_event():
            parsed.append(events.get_event())
            if len(parsed) % _EVENTS == 0:
                yield
        loader = _Replay(parsed)
        root = loader.get_single_node()
        yield
        return YamlText(None if root is None else loader.construct_document(root), root)
    except (ValueError, yaml.YAMLError, RecursionError) as error:
        mark = getattr(error, "problem_mark", None) or getattr(error, "context_mark", None)
        place = TextPlace(1, 1) if mark is None else TextPlace.of(mark)
        return TextMistake(place, _problem(error) or _first_line(error))


@contextmanager
def located(path: Path) -> Iterator[None]:
    """Add line, column and file to an `InvalidJob` that the block raises about the job in the file at `path`.

    The sentence counts steps from 1, as a person does; the detail `key` stays as it is.
    """
    try:
        yield
    except InvalidJob as error:
        key = str(error.details["key"])
        place = None if error.verbatim else _place(path, key)
        if place is None:
            raise
        where = phrase(
            "{key} ({file}, line {line}, column {column})",
            key=_counted(key),
            file=path.name,
            line=place.line,
            column=place.column,
        )
        details = {**error.details, "file": path.name, "line": place.line, "column": place.column}
        raise InvalidJob.rebuilt(details, str(error.copy(key=where))) from error


def _place(path: Path, key: str) -> TextPlace | None:
    """Return the place of a dotted key in a file, None if the file does not have it or cannot be read again."""
    try:
        reading = read_yaml(_text(path))
    except FileUnreadable:
        return None
    while True:
        try:
            next(reading)
        except StopIteration as end:
            found: YamlText | TextMistake = end.value
            break
    if isinstance(found, TextMistake) or not isinstance(found.data, dict):
        return None
    return found.place(key) if key.partition(".")[0] in found.data else None


def _counted(key: str) -> str:
    """Return a dotted key with steps as a person counts them: "step 3, pick" for steps.2.pick."""
    first, *rest = key.split(".")
    if first != "steps" or not rest or not rest[0].isdecimal():
        return key
    step = phrase("step {number}", number=int(rest[0]) + 1)
    inner = ".".join(
        str(int(part) + 1) if before in {"do", "then", "else"} else part for before, part in pairwise(rest)
    )
    return phrase("{step}, {key}", step=step, key=inner) if inner else step


class _Replay(_Loader):
    """Loads a document from parsed events."""

    def __init__(self, events: list[yaml.Event]) -> None:
        super().__init__("")
        self._events = events
        self._next = 0

    def check_event(self, *choices: type[yaml.Event]) -> bool:
        if self._next >= len(self._events):
            return False
        return not choices or isinstance(self._events[self._next], choices)

    def peek_event(self) -> yaml.Event:
        return self._events[self._next]

    def get_event(self) -> yaml.Event:
        self._next += 1
        return self._events[self._next - 1]


class _Dumper(yaml.SafeDumper):
    """Writes lists of plain values on one line, and everything else in blocks."""

    def represent_sequence(self, tag: str, sequence: Any, flow_style: bool | None = None) -> yaml.SequenceNode:
        plain = all(not isinstance(one, dict | list | tuple | str) for one in sequence)
        return super().represent_sequence(tag, sequence, flow_style=plain)


def write_yaml(data: Any) -> str:
    """Return plain data as YAML, in the order of its keys."""
    return yaml.dump(data, Dumper=_Dumper, sort_keys=False, allow_unicode=True, default_flow_style=False, width=120)


def _first_line(error: Exception) -> str:
    if isinstance(error, RecursionError):
        return phrase("it is nested too deeply")
    mark = getattr(error, "problem_mark", None)
    problem = _problem(error) or str(error).partition("\n")[0]
    return problem if mark is None else phrase("{problem} (line {number})", problem=problem, number=mark.line + 1)


def _problem(error: Exception) -> str:
    """Return what the parser of YAML says, empty for another error."""
    problem: str = getattr(error, "problem", None) or ""
    return phrase("a line begins with a tab; begin it with spaces") if "'\\t'" in problem else problem
