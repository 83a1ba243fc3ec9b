"""Texts are translated by the catalogues of the packages; English needs none."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from time import process_time
from types import ModuleType

import pytest

from dmc41x3 import i18n
from dmc41x3.errors import FileUnreadable
from dmc41x3.i18n import marked, phrase, translate, translate_phrase
from maya_un.errors import NothingToRecover, StepFailed

UNREADABLE = FileUnreadable.en

ENGLISH = """
import sys
from maya_un.errors import NotHomed
print(NotHomed(command="maya home").text("en"), "gettext" in sys.modules)
"""


@pytest.mark.parametrize("language", ["en", "fr", ""])
def test_english_and_unknown_languages_read_as_the_code(language: str) -> None:
    assert translate("There is no fault to recover from.", language) == "There is no fault to recover from."


def test_a_text_is_found_in_the_catalogue_of_each_package() -> None:
    assert translate(NothingToRecover.en, "es") == "No hay ningún fallo del que recuperarse."
    assert translate(UNREADABLE, "es") == "No se pudo leer {path}: {reason}. Corrija el archivo o indique otro."


def test_details_are_filled_in_if_present() -> None:
    assert translate(UNREADABLE, "es", path="a", reason="b").startswith("No se pudo leer a: b.")
    assert translate(UNREADABLE, "en") == UNREADABLE


def test_context_distinguishes_equal_texts() -> None:
    assert translate(marked("held", "WrongState.action"), "es", "WrongState.action") == "retenerlo"
    assert translate("held", "es", "WrongState.state") == "retenido"


@pytest.mark.parametrize("text", ["", "a text of nobody", "{open"])
def test_a_text_without_a_translation_stays(text: str) -> None:
    assert translate(text, "es") == text


def test_a_phrase_is_english_with_its_details() -> None:
    assert phrase("it must be {least:g} to {most:g} Hz", least=0.5, most=60.0) == "it must be 0.5 to 60 Hz"
    assert phrase("it must be an object like {{x: 0.5}}") == "it must be an object like {x: 0.5}"
    assert phrase("{name} is missing", name="{x}") == "{x} is missing"


@pytest.mark.parametrize(
    ("text", "spanish"),
    [
        ("it must be a text", "debe ser un texto"),
        ("it has more than 5 bytes", "tiene más de 5 bytes"),
        ("it must be a number between -10000 and 10000, not 5", "debe ser un número entre -10000 y 10000, no 5"),
        ("it must be an object like {x: 0.5, y: 1.1, z: 0.4}", "debe ser un objeto como {x: 0.5, y: 1.1, z: 0.4}"),
        ("grid: it has more than 5 bytes", "grid: tiene más de 5 bytes"),
        ("zero of a, zero of b and length (D)", "cero de a, cero de b y longitud (D)"),
        ("zero of a, zero of q", "zero of a, zero of q"),
        ("it is not TOML: Invalid value (at line 1)", "no es TOML: Invalid value (at line 1)"),
        ("Permission denied", "Permission denied"),
        ("the two together are too much (There is no fault to recover from.)",
         "los dos juntos son demasiado (No hay ningún fallo del que recuperarse.)"),
    ],
)  # fmt: skip
def test_a_phrase_is_found_by_its_text(text: str, spanish: str) -> None:
    assert translate_phrase(text, "es") == spanish
    assert translate_phrase(text, "en") == translate_phrase(text, "fr") == text


def test_a_text_that_nearly_fits_a_template_costs_little() -> None:
    """Its separators stand so often that a search that tries all their places takes a second."""
    end = StepFailed.en.partition("{error_code}")[2]
    near = f"Step {' of ' * 72}{' failed: ' * 32}{' (' * 155}{end}!"
    began = process_time()
    assert translate_phrase(near, "es") == near
    assert process_time() - began < 0.2


def test_the_longest_template_that_matches_is_taken() -> None:
    assert translate_phrase("there is no such key; known are a, b", "es") == "no existe esa clave; se conocen a, b"
    assert translate_phrase("it must be one of a, b", "es") == "debe ser uno de a, b"


def test_english_does_not_import_gettext() -> None:
    done = subprocess.run([sys.executable, "-c", ENGLISH], capture_output=True, text=True, check=True)
    assert done.stdout == "The robot is not homed, so its position is not known. Run `maya home` first. False\n"


@pytest.mark.parametrize("content", [None, b"", b"\xde\x12\x04\x95", b"\xde\x12\x04\x95" + 20 * b"\xff", b"text"])
def test_texts_stay_english_where_a_catalogue_is_missing_or_damaged(
    content: bytes | None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    package = ModuleType("broken_package")
    package.__path__ = [str(tmp_path)]
    monkeypatch.setitem(sys.modules, package.__name__, package)
    monkeypatch.setattr(i18n, "_packages", [package.__name__, "dmc41x3"])
    if content is not None:
        file = tmp_path / "locale" / "es" / "LC_MESSAGES" / "broken_package.mo"
        file.parent.mkdir(parents=True)
        file.write_bytes(content)
    assert translate("a text of the package", "es") == "a text of the package"
    assert translate(UNREADABLE, "es") == "No se pudo leer {path}: {reason}. Corrija el archivo o indique otro."
    monkeypatch.setattr(i18n, "_packages", [package.__name__])
    assert translate(UNREADABLE, "es") == UNREADABLE
