"""The script of the translations finds every text, and tells what is wrong with a catalogue."""

from __future__ import annotations

import runpy
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from tests.conventions.source import ROOT

CODE = """
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
