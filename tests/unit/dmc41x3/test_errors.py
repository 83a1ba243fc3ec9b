"""The errors of the package have sentences of their own, without Maya."""

from __future__ import annotations

import json
import subprocess
import sys

import pytest

from dmc41x3 import errors
from dmc41x3.i18n import LANGUAGES

PROGRAM = """
import json, sys
from dmc41x3 import errors, i18n
tables = {
    language: {code: error.template(language) for code, error in errors.by_code().items()}
    for language in i18n.LANGUAGES
}
print(json.dumps({
    "codes": list(errors.by_code()),
    "tables": tables,
    "said": str(errors.LinkLost(address="10.0.0.5:23", reason="reset")),
    "maya": [name for name in sys.modules if name.startswith("maya_un")],
}))
"""


@pytest.fixture(scope="module")
def alone() -> dict[str, object]:
    """Return the errors and sentences of a process that does not import maya_un."""
    done = subprocess.run([sys.executable, "-c", PROGRAM], capture_output=True, text=True, check=True)
    return json.loads(done.stdout)


def test_the_errors_need_no_maya(alone: dict[str, object]) -> None:
    assert alone["maya"] == []
    assert alone["said"] == (
        "The connection to the controller at 10.0.0.5:23 was lost (reset). The axes finish what was already sent. "
        "Check cable and power, then connect again."
    )


@pytest.mark.parametrize("language", LANGUAGES)
def test_each_error_has_a_sentence_that_does_not_name_maya(language: str, alone: dict[str, dict[str, object]]) -> None:
    table = alone["tables"][language]
    assert isinstance(table, dict)
    assert [int(code) for code in table] == alone["codes"]
    assert [sentence for sentence in table.values() if "maya" in sentence.lower()] == []


def test_maya_adds_its_own_advice() -> None:
    import maya_un.errors

    assert maya_un.errors.LinkLost is errors.LinkLost
    assert str(errors.LinkLost(address="sim", reason="reset")).endswith("then run `maya recover`.")
