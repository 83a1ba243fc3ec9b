"""Programs as people write them, prepared for a controller: omissions, conversions, cuts, and reports."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from dmc41x3.language.commands import LINE_LIMIT
from dmc41x3.language.transfer import prepared

LONG = "x" * LINE_LIMIT
PLAIN = st.text(st.characters(codec="ascii", exclude_categories=("Cc",)), max_size=LINE_LIMIT).filter(
    lambda line: line and not line.lstrip().startswith(("REM", "##")) and line == line.rstrip()
)


@pytest.mark.parametrize(
    ("line", "kept"),
    [
        ("MG 1", "MG 1"),
        ("", "'"),
        ("  ", "'"),
        ("'a remark", "'a remark"),
        ("\tMG\t1", " MG 1"),
        ("MG 1  \t", "MG 1"),
        (f"MG 1;'{LONG}", "MG 1"),
        (f"MG 1 ; '{LONG}", "MG 1"),
        (f"'{LONG}", "'"),
        (f"MG \"it's\";'{LONG}", 'MG "it\'s"'),
        ("MG 1;'°", "MG 1"),
        ("REMOTE=1", "REMOTE=1"),
        ("REMOTE =1", "REMOTE =1"),
        ("MG 1 // kept", "MG 1 // kept"),
        ("## kept", "## kept"),
        (LONG + "y", LONG + "y"),
        ('MG "°"', 'MG "°"'),
    ],
)
def test_line_is_made_ready(line: str, kept: str) -> None:
    """REM and the length of a line are of Galil's command reference, tabs as M2FS's programmer has them.

    PyGalil tells that Galil's terminal marks empty lines.
    """
    assert prepared(f"{line}\nEN\n").lines == (kept, "EN")


@pytest.mark.parametrize("line", ["REM", "REM a remark", "REMark", " \tREM x", "REM===", f"REM {LONG}", "REM »°«"])
def test_remark_for_the_host_stays_there(line: str) -> None:
    """G, REM: Galil's software strips these lines before a download, however long they are."""
    found = prepared(f"MG 1\r\n{line}\r\nEN")
    assert found.lines == ("MG 1", "EN")
    assert found.changes == ("left out 1 line of REM or host remarks",)


def test_double_hashes_and_slashes_are_for_the_host_on_request() -> None:
    """gclib's preprocessor: two lines of `##` in front switch it on."""
    text = '## Author: A\n## Date: B\nMG 1 // said\nMG "a//b";\'c // d\n##option "--min 4"\nEN\n'
    assert prepared(text).lines == ("MG 1", 'MG "a//b";\'c // d', "EN")


def test_changes_have_their_line_numbers() -> None:
    found = prepared(f"REM a\nREM b\n\tMG 1\nMG 2;'{LONG}\n\nEN\n")
    assert found.changes == (
        "left out 2 lines of REM or host remarks",
        "replaced tabs by blanks in 1 line",
        "cut off the comment of 1 line",
        "turned 1 line without text into comments",
    )
    assert found.text == " MG 1\nMG 2\n'\nEN\n"


@given(st.lists(PLAIN, max_size=8))
def test_program_that_fits_is_not_changed(lines: list[str]) -> None:
    found = prepared("".join(f"{line}\n" for line in lines))
    assert found.lines == tuple(lines)
    assert found.changes == ()


@given(st.text(max_size=300))
def test_any_text_is_made_ready_twice_as_once(text: str) -> None:
    once = prepared(text)
    if not once.text.lstrip().startswith("##"):
        assert prepared(once.text).lines == once.lines
