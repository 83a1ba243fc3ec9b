"""Tables of arrays."""

from __future__ import annotations

from pathlib import Path

import pytest

from dmc41x3.gclib import api
from dmc41x3.gclib.errors import Code, GclibError


def test_a_table_has_a_column_for_each_array() -> None:
    table = {"a": [1.0, -2.5], "bb": [3.0]}
    assert api.text_of(table) == "a,bb\n1.0000,3.0000\n-2.5000,\n"
    assert api.table_of(api.text_of(table)) == table


def test_names_may_have_brackets() -> None:
    assert api.table_of("a[], b\r\n1,2\r\n") == {"a": [1.0], "b": [2.0]}


@pytest.mark.parametrize("text", ["", "a,b\n1\n", "a\n1,2\n", "a\nx\n", "a\n"])
def test_invalid_table(text: str) -> None:
    with pytest.raises(GclibError) as caught:
        api.table_of(text)
    assert caught.value.code is Code.FILE


def test_files_that_cannot_be_read_or_written(tmp_path: Path) -> None:
    for work in (
        lambda: api.read_text(str(tmp_path / "none")),
        lambda: api.write_text(str(tmp_path / "no" / "where"), ""),
        lambda: api.write_text(str(tmp_path / "file"), "ñ"),
    ):
        with pytest.raises(GclibError, match="file was not found, contents are invalid, or write failed"):
            work()


def test_line_ends_stay_as_they_are(tmp_path: Path) -> None:
    api.write_text(str(tmp_path / "p.dmc"), "#A\r\nEN\r\n")
    assert (tmp_path / "p.dmc").read_bytes() == b"#A\r\nEN\r\n"
