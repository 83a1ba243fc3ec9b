from __future__ import annotations

import resource
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from maya_un.config import Config
from maya_un.errors import FileUnreadable, FileUnwritable, InvalidValue
from maya_un.service.calibration import points
from maya_un.service.calibration.points import HEAD, PointNotebook, datum_of, read
from maya_un.values import Point

CONFIG = Config()
ROW = "21261,1500000,1400000,1.1,0.7,0.8"


def file(tmp_path: Path, text: str | bytes) -> Path:
    path = tmp_path / "points.csv"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return path


def refusal(tmp_path: Path, text: str) -> str:
    with pytest.raises(InvalidValue) as refused:
        read(file(tmp_path, text), CONFIG)
    return str(refused.value)


@pytest.mark.parametrize("head", ["a,b,c,x,y,z", "a_counts,b_counts,c_counts,x,y,z", " A, B ,C,X,Y,Z "])
def test_counts_are_taken_as_they_are(tmp_path: Path, head: str) -> None:
    seen = read(file(tmp_path, f"{head}\n{ROW}\n"), CONFIG).observations
    assert seen.counts.tolist() == [[21261.0, 1.5e6, 1.4e6]]
    assert seen.points.tolist() == [[1.1, 0.7, 0.8]]
    assert seen.sigma is None


def test_joints_become_the_counts_that_the_configuration_reads_them_from(tmp_path: Path) -> None:
    seen = read(file(tmp_path, "a_rad,b_m,c_m,x,y,z\n1.0,1.5,1.4,1.1,0.7,0.8\n"), CONFIG).observations
    assert seen.counts == pytest.approx(np.array([[371.06 * 180.0 / np.pi, 1.5e6, 1.4e6]]))


def test_columns_may_have_any_order_and_rows_have_line_numbers(tmp_path: Path) -> None:
    text = f"# a note\n\nsigma,x,y,z,c,b,a\n0.001,1.1,0.7,0.8,1400000,1500000,21261\n\n# {ROW}\n.002,1,1,1,1e6,2e6,0\n"
    seen = read(file(tmp_path, text), CONFIG).observations
    assert seen.rows == (4, 7)
    assert seen.sigma is not None
    assert seen.sigma.tolist() == [0.001, 0.002]
    assert seen.counts[1].tolist() == [0.0, 2e6, 1e6]


def test_a_spreadsheet_may_have_written_it(tmp_path: Path) -> None:
    text = '\ufeff"a","b","c","x","y","z"\r\n21261,"1500000",1400000,1.1,0.7,0.8\r\n'
    assert read(file(tmp_path, text), CONFIG).observations.points.tolist() == [[1.1, 0.7, 0.8]]


def test_counts_move_with_the_switches(tmp_path: Path) -> None:
    """The file was measured where homing put the switches at 10, 574000, 565000.5; now they are elsewhere."""
    measured = read(file(tmp_path, f"# datum 10 574000 565000.5\na,b,c,x,y,z\n{ROW}\n"), CONFIG)
    assert measured.datum == (10.0, 574000.0, 565000.5)
    assert measured.observations.counts.tolist() == [[21251.0, 1501000.0, 1399999.5]]


def test_datum_is_at_the_short_ends() -> None:
    assert datum_of(CONFIG) == pytest.approx((0.0, 575_000.0, 565_000.0))


def test_the_same_text_has_the_same_fingerprint_and_another_one_has_not(tmp_path: Path) -> None:
    text = f"a,b,c,x,y,z\n{ROW}\n"
    first = read(file(tmp_path, text), CONFIG).digest
    assert first == read(file(tmp_path, text), CONFIG).digest
    assert first != read(file(tmp_path, text + "# more\n"), CONFIG).digest


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("a,b,c,x,y\n1,2,3,4,5\n", "row 1, column z"),
        ("a,b,c,x,y,z,w\n", "row 1, column w"),
        ("a,b,c,x,y,z,z\n", "row 1, column z"),
        ("x,y,z\n", "row 1, column a"),
        ("a,b_m,c,x,y,z\n", "row 1, column a"),
        ("a,b,c,a_rad,x,y,z\n", "row 1, column a_rad"),
        ("a;b;c;x;y;z\n1;2;3;4;5;6\n", "separated by commas"),
        (f"a,b,c,x,y,z\n{ROW}\n{ROW},7\n", "row 3, column z"),
        (f"a,b,c,x,y,z\n{ROW}\n1,2\n", "row 3, column c"),
        (f"a,b,c,x,y,z\n{ROW}\n1,2000000,3000000,1.0,none,1.0\n", "row 3, column y = 'none'"),
        ("a,b,c,x,y,z\n1,2000000,2000000,1.0,,1.0\n", "row 2, column y = ''"),
        ("a,b,c,x,y,z\n1,2000000,2000000,1.0,nan,1.0\n", "not finite"),
        ("a,b,c,x,y,z\n1,inf,2000000,1.0,1.0,1.0\n", "row 2, column b"),
        ('a,b,c,x,y,z\n1,"2000000,2000000,1,1,1\n', "row 2, column b"),
        ("a,b,c,x,y,z\n1,2000000,2000000,1100,700,800\n", "looks like millimetres"),
        ("a,b,c,x,y,z\n1.0,1.5,1.4,1.1,0.7,0.8\n", "look like lengths"),
        ("a_rad,b_m,c_m,x,y,z\n57.0,1.5,1.4,1.1,0.7,0.8\n", "more than a turn"),
        ("a_rad,b_m,c_m,x,y,z\n1.0,-1.5,1.4,1.1,0.7,0.8\n", "row 2, column b_m"),
        ("a,b,c,x,y,z\n1,2000000,20000000,1.1,0.7,0.8\n", "a line of 20 m"),
        (f"a,b,c,x,y,z,sigma\n{ROW},0\n", "row 2, column sigma"),
        (f"a,b,c,x,y,z,sigma\n{ROW},-0.001\n", "row 2, column sigma"),
        (f"a,b,c,x,y,z,sigma\n{ROW},1.5\n", "row 2, column sigma"),
        ("# datum 0 575000 565000\na_rad,b_m,c_m,x,y,z\n1.0,1.5,1.4,1.1,0.7,0.8\n", "holds counts"),
    ],
)
def test_error_is_named_by_row_and_column(tmp_path: Path, text: str, said: str) -> None:
    assert said in refusal(tmp_path, text)
    assert "points.csv" in refusal(tmp_path, text)


@given(st.text(alphabet="abcxyz,.-+e0123456789\"'#; \n\t_", max_size=200), st.booleans())
def test_any_file_is_read_or_refused(text: str, headed: bool) -> None:
    with TemporaryDirectory() as folder:
        path = Path(folder) / "points.csv"
        path.write_text(f"a,b,c,x,y,z\n{text}" if headed else text)
        try:
            measured = read(path, CONFIG)
        except (InvalidValue, FileUnreadable):
            return
    assert np.all(np.isfinite(measured.observations.points))
    assert np.all(measured.observations.counts[:, 1:] > 0.0)


@given(st.binary(max_size=300))
def test_bytes_are_read_or_refused(content: bytes) -> None:
    with TemporaryDirectory() as folder:
        path = Path(folder) / "points.csv"
        path.write_bytes(content)
        with pytest.raises((InvalidValue, FileUnreadable)):
            read(path, CONFIG)


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        (b"", "empty"),
        (b"# nothing\n\n", "empty"),
        (b"a,b,c,x,y,z\n", "no points"),
        (b"\xff\xfea,b\n", "UTF-8"),
        (b"#" * (points.MOST_BYTES + 1), "larger than"),
    ],
)
def test_invalid_table_is_refused(tmp_path: Path, content: bytes, reason: str) -> None:
    with pytest.raises(FileUnreadable, match=reason):
        read(file(tmp_path, content), CONFIG)


def test_a_file_that_is_not_there_is_refused(tmp_path: Path) -> None:
    with pytest.raises(FileUnreadable):
        read(tmp_path / "none.csv", CONFIG)


def test_a_notebook_is_read_back_as_it_was_written(tmp_path: Path) -> None:
    path = tmp_path / "points.csv"
    notebook = PointNotebook(path, CONFIG)
    notebook.add((1, 1_500_000, 1_400_000), Point(1.1, 0.7, 0.8000004))
    PointNotebook(path, CONFIG).add((-2, 1_500_001, 1_400_001), Point(-0.1, 0.7, 0.8))
    measured = read(path, CONFIG)
    assert (measured.head, measured.datum) == (HEAD, pytest.approx((0.0, 575_000.0, 565_000.0)))
    assert measured.observations.counts[1].tolist() == [-2.0, 1_500_001.0, 1_400_001.0]
    assert measured.observations.points.tolist() == [[1.1, 0.7, 0.8], [-0.1, 0.7, 0.8]]


def test_each_row_is_in_the_file_at_once(tmp_path: Path) -> None:
    path = tmp_path / "points.csv"
    notebook = PointNotebook(path, CONFIG)
    for count in range(1, 4):
        notebook.add((1, 1_500_000, 1_400_000), Point(1.1, 0.7, 0.8))
        assert len(read(path, CONFIG).observations) == count


def test_a_last_line_without_its_end_is_ended_first(tmp_path: Path) -> None:
    path = file(tmp_path, f"a_counts,b_counts,c_counts,x,y,z\n{ROW}")
    PointNotebook(path, CONFIG).add((1, 1_500_000, 1_400_000), Point(1.1, 0.7, 0.8))
    assert len(read(path, CONFIG).observations) == 2


def test_unwritable_place_is_reported(tmp_path: Path) -> None:
    with pytest.raises(FileUnwritable):
        PointNotebook(tmp_path / "no" / "points.csv", CONFIG)


def test_invalid_row_is_not_begun(tmp_path: Path) -> None:
    path = tmp_path / "points.csv"
    notebook = PointNotebook(path, CONFIG)
    notebook.add((-2, 1_500_001, 1_400_001), Point(-0.1, 0.7, 0.8))
    before = path.read_bytes()
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (len(before) + 30, limits[1]))  # as a full disk has it
    try:
        with pytest.raises(FileUnwritable):
            notebook.add((-2, 1_500_001, 1_400_001), Point(-0.1, 0.7, 0.812345))
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert path.read_bytes() == before


def test_name_impossible_for_a_file_is_reported(tmp_path: Path) -> None:
    with pytest.raises(FileUnwritable):
        PointNotebook(tmp_path / ("x" * 300), CONFIG)
