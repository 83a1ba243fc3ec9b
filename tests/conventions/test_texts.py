"""The script of the translations finds every text, and tells what is wrong with a catalogue."""

from __future__ import annotations

import ast
import runpy
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from tests.conventions import source
from tests.conventions.source import ROOT

CODE = """
raise NotHomed
raise InvalidValue(key="a b", value="c d", reason="it is late" if late else phrase("it is {count} s late", count=count))
raise UnknownName(name="a b", known=", ".join(names) or "no names")
print(marked("it is {count} late", PHRASE), phrase("{name}: {reason}", name=name, reason=reason))
class Late(Event, word="late", en="late by {seconds} s"): ...
print(translate("There are {count}.", language).format(count=2), translate("fixed", language, "constant"))
print(translate("one" if count == 1 else "many", language), marked("later", "job"), i18n.translate("a" "b", language))
reword(Late, "very late")
print(translate(text, language), other("no text"), f"{language}")
"""


@pytest.fixture(scope="module")
def script() -> Any:
    return SimpleNamespace(**runpy.run_path(str(ROOT / "scripts" / "texts.py")))


def test_every_text_of_the_code_is_found(script: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "late.py").write_text(CODE, encoding="utf-8")
    monkeypatch.setitem(script.texts.__globals__, "SOURCE", tmp_path)
    found = {(text.english, text.context, text.file) for text in script.texts(tmp_path)}
    assert found == {
        ("late by {seconds} s", "", "late.py"), ("There are {count}.", "", "late.py"),
        ("fixed", "constant", "late.py"), ("one", "", "late.py"), ("many", "", "late.py"),
        ("later", "job", "late.py"), ("ab", "", "late.py"), ("very late", "", "late.py"),
        ("it is late", "phrase", "late.py"), ("it is {count} s late", "phrase", "late.py"),
        ("no names", "phrase", "late.py"), ("it is {count} late", "phrase", "late.py"),
    }  # fmt: skip


@pytest.mark.parametrize(
    ("stored", "problem"),
    [
        ('msgid "late by {seconds} s"\nmsgstr "tarde"', "other placeholders than in English: 'tarde'"),
        ('msgid "late by {seconds} s"\nmsgstr ""', "not translated: 'late by {seconds} s'"),
        ('#, fuzzy\nmsgid "late by {seconds} s"\nmsgstr "{seconds} s tarde"', "fuzzy: 'late by {seconds} s'"),
        ('msgid "early"\nmsgstr "temprano"', "obsolete: 'early'"),
        ('msgctxt "x"\nmsgid "late by {seconds} s"\nmsgstr "{seconds}"', "not translated: 'late by {seconds} s'"),
        ('msgid "late by {seconds} s"\nmsgstr "{seconds} s tarde"', "not compiled"),
    ],
)
def test_a_catalogue_that_differs_from_the_code_is_reported(
    script: Any, tmp_path: Path, stored: str, problem: str
) -> None:
    file = tmp_path / "late.po"
    file.write_text(f'msgid ""\nmsgstr "Content-Type: text/plain; charset=utf-8\\n"\n\n{stored}\n', encoding="utf-8")
    template = script.Catalog()
    template.add("late by {seconds} s")
    assert problem in [*script.differences(template, script.stored(file, "es")), *script.stale(file, "es")]


def test_translated_and_compiled_text_is_no_problem(script: Any, tmp_path: Path) -> None:
    file = tmp_path / "late.po"
    file.write_text('msgid ""\nmsgstr ""\n\nmsgid "late"\nmsgstr "tarde"\n', encoding="utf-8")
    template = script.Catalog()
    template.add("late")
    script.update(file, template, "es")
    assert [*script.differences(template, script.stored(file, "es")), *script.stale(file, "es")] == []
    written = file.read_bytes()
    script.update(file, template, "es")
    assert file.read_bytes() == written


def test_the_catalogues_are_complete(script: Any, capsys: pytest.CaptureFixture[str]) -> None:
    assert (script.main(["--check"]), capsys.readouterr().out) == (0, "")


@pytest.mark.parametrize(
    ("code", "problem"),
    [
        ('raise InvalidValue(key="a", value=1, reason=f"it is {late}")', "it is {late}' cannot be translated"),
        ('raise InvalidValue(key="a", value=1, reason=old or f"it is {late}")', "it is {late}' cannot be translated"),
        ('raise InvalidRequest(key="a", reason="it is {late}")', "'it is {late}' has a brace"),
        (
            'def f():\n    reason = "it is late"\n    raise InvalidRequest(key="a", reason=reason)',
            "reason is a plain text",
        ),
        ('_LATE = f"it is {late}"\nraise InvalidRequest(key="a", reason=_LATE)', "_LATE is a plain text"),
        ("reason = phrase(text)", "phrase(text) has no constant template"),
        ('reason = phrase("it is {late}", late=late, early=early)', "has other placeholders than the arguments"),
        ('reason = phrase("it is {late}")', "has other placeholders than the arguments"),
    ],
)
def test_a_phrase_that_cannot_be_extracted_is_reported(script: Any, code: str, problem: str) -> None:
    (found,) = script.hidden_in(ast.parse(code), "late.py")
    assert problem in found


@pytest.mark.parametrize(
    "code",
    [
        'raise InvalidValue(key=f"args.{name}", value=repr(value), reason="it is late")',
        "raise FileUnreadable(path=path, reason=error.strerror or str(error))",
        'raise FileUnreadable(path=path, reason=f"{editor}: {error.strerror}")',
        'reason = phrase("it is {late:g}", late=late)\nraise InvalidRequest(key="a", reason=reason)',
        'def f():\n    reason = f"{a} b"\ndef g(reason):\n    raise InvalidRequest(key="a", reason=reason)',
    ],
)
def test_phrases_that_are_extracted_or_from_elsewhere_are_no_problem(script: Any, code: str) -> None:
    assert list(script.hidden_in(ast.parse(code), "late.py")) == []


def test_no_reason_of_the_code_is_a_formatted_text() -> None:
    given = [
        (module.name, keyword.value)
        for module in source.modules()
        for node in ast.walk(module.tree)
        if isinstance(node, ast.Call)
        for keyword in node.keywords
        if keyword.arg in {"reason", "remedy"} and isinstance(keyword.value, ast.JoinedStr)
    ]
    words = [(name, ast.unparse(text)) for name, text in given if any(character.isalpha() for character in said(text))]
    assert words == []


def said(text: ast.JoinedStr) -> str:
    return "".join(str(part.value) for part in text.values if isinstance(part, ast.Constant))
