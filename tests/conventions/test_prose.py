"""The check of English finds turned sentences and private words, and leaves code, questions and records alone."""

from __future__ import annotations

import runpy
from pathlib import Path
from typing import Any

import pytest

from tests.conventions.source import ROOT

PROSE: dict[str, Any] = runpy.run_path(str(ROOT / "scripts" / "prose.py"))


def found(name: str, text: str) -> list[tuple[int, str]]:
    return [(one.line, one.start) for one in PROSE["check"](Path(name), text)]


@pytest.mark.parametrize(
    "text",
    [
        "Whoever may not is refused.",
        "It stops. What moved is at rest.",
        "- **Stop.** Who drives may stop.",
        "| key | Where it is. |",
        "A wish is refused.",
        "Lo que se detuvo se empieza de nuevo.",
        "The sentence goes over\ntwo lines. Where it\nends is here.",
    ],
)
def test_turned_sentence_or_private_word_on_a_page_is_found(text: str) -> None:
    assert len(found("page.md", text)) == 1


@pytest.mark.parametrize(
    "text",
    [
        "What stops the robot?",
        "## What stops it",
        "The part is where it was put.",
        "Call `floor(x)` on [a page](../layers-as-ros-nodes.md).",
        "```\nWhat runs here is code\n```",
        "<!-- Who reads this -->",
    ],
)
def test_a_question_a_title_and_code_are_left_alone(text: str) -> None:
    assert found("page.md", text) == []


def test_docstrings_comments_and_strings_of_python_are_checked_with_their_lines() -> None:
    source = '"""Good.\n\nWho asks is told.\n"""\n\n# what is left\nX = f"What {1} is refused."\nwish = 1\n'
    assert found("module.py", source) == [(3, "Who asks is told."), (7, "What X is refused."), (6, "What is left")]


def test_strings_of_tests_are_data_and_their_docstrings_are_checked() -> None:
    source = '"""Who asks is told."""\n\nX = "pick from the shelf"  # a wish is refused\n'
    path = str(ROOT / "tests" / "test_module.py")
    assert found(path, source) == [(1, "Who asks is told."), (3, "A wish is refused")]


@pytest.mark.parametrize("start", ["Be a client.", "It, as the queue.", "So many are read.", "So long it waits [s]."])
def test_a_docstring_that_leaves_its_subject_out_is_found(start: str) -> None:
    assert found("module.py", f'"""Good. {start}"""\n') == [(1, start)]
    assert found("page.md", start) == []


def test_docstrings_of_tests_are_checked_more_strictly() -> None:
    source = '"""Those of the page. Come again."""\n'
    assert found("module.py", source) == []
    assert len(found(str(ROOT / "tests" / "test_module.py"), source)) == 2


def test_comments_of_scripts_are_checked_with_their_lines() -> None:
    script = """
/** What is drawn. */
const url = "http://a/b"; // who asks is told
/**
 * Good.
 * Where it is, is known.
 */
const word = "What is drawn.";
  // It is told who asks, and
  // whoever asks. Who may, may.
"""
    assert found(str(ROOT / "web/src/a.ts"), script) == [
        (2, "What is drawn."), (3, "Who asks is told"), (4, "Where it is, is known."), (9, "Who may, may.")
    ]  # fmt: skip
    component = "<template>\n  <!-- Who asks is told. -->\n</template>\n<style>\n/* What is wide. */\n</style>\n"
    assert found(str(ROOT / "web/src/A.vue"), component) == [(2, "Who asks is told."), (5, "What is wide.")]


def test_texts_of_the_dashboard_are_checked_and_labels_are_not() -> None:
    script = 'const A = { a: ["What the robot does", "Qué hace"], b: ["What moves stops.", "Quien conduce, para."] };\n'
    assert found(str(ROOT / "web/src/words/a.ts"), script) == [(1, "What moves stops."), (1, "Quien conduce, para.")]


def test_source_code_in_a_generator_is_left_alone() -> None:
    assert found("generator.py", 'CODE = """\nfrom a.b import wish\n"""\n') == []


def test_released_versions_keep_their_words() -> None:
    assert found("CHANGELOG.md", "# Changelog\n\n## [Unreleased]\n\n## [1.0]\n\nWhat is new.\n") == []


def test_a_path_that_is_not_there_fails(capsys: pytest.CaptureFixture[str]) -> None:
    assert PROSE["main"](["src/no_such_folder"]) == 1
    assert "is not there" in capsys.readouterr().out
