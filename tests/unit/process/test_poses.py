"""The pose store: poses are read back, from a file that people edit too."""

from __future__ import annotations

import os
import tempfile
import tomllib
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from maya_un.config import Config
from maya_un.errors import FileUnreadable, FileUnwritable, InvalidValue, NameTaken, NotTaught
from maya_un.kinematics.mechanism import Mechanism
from maya_un.process.spec.job import Grid
from maya_un.process.spec.pallet import Cell
from maya_un.process.spec.poses import MOST_BYTES, PoseStore, checked_name
from maya_un.values import Joints, Point

MECHANISM = Mechanism.of(Config())
SHELF, BENCH = Joints(0.4, 1.6, 1.3), Joints(1.1, 1.5, 1.6)
DAY = "2026-11-21T16:02:21+00:00"
GRID = Grid.model_validate({"corners": ["shelf", "bench", [0.3, 1.2]], "rows": 3, "columns": 4})


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "maya" / "poses.toml"


@pytest.fixture
def pose_store(path: Path) -> PoseStore:
    kept = PoseStore(MECHANISM, path)
    kept.teach("shelf", SHELF, DAY)
    kept.teach("bench", BENCH, DAY)
    return kept


def test_a_taught_pose_is_there_for_every_reader_of_the_file(pose_store: PoseStore, path: Path) -> None:
    pose = PoseStore(MECHANISM, path).taught().poses["shelf"]
    assert (pose.name, pose.joints, pose.taught) == ("shelf", SHELF, DAY)
    assert pose.point == MECHANISM.fk(SHELF)
    assert pose_store.taught().names == ("shelf", "bench")


def test_file_has_the_position_of_the_gripper(pose_store: PoseStore, path: Path) -> None:
    entry = tomllib.loads(path.read_text(encoding="utf-8"))["poses"]["shelf"]
    assert entry == {"joints": list(SHELF), "point": list(MECHANISM.fk(SHELF)), "taught": DAY}
    assert [file.name for file in path.parent.iterdir()] == ["poses.toml"]


def test_joints_are_kept_and_the_point_is_that_of_the_constants_in_force(pose_store: PoseStore, path: Path) -> None:
    geometry = Config().geometry.model_copy(update={"height": 2.36})
    corrected = Mechanism.of(Config().model_copy(update={"geometry": geometry}))
    pose = PoseStore(corrected, path).taught().poses["shelf"]
    before = MECHANISM.fk(SHELF)
    assert pose.joints == SHELF
    assert pose.point == pytest.approx((before.x, before.y, before.z + 0.01))


def test_pose_whose_lines_cannot_meet_has_no_point(pose_store: PoseStore) -> None:
    assert pose_store.teach("slack", Joints(0.4, 0.6, 0.6), DAY).point is None
    assert pose_store.taught().poses["slack"].point is None


def test_a_name_is_taught_once_unless_it_is_to_be_replaced(pose_store: PoseStore) -> None:
    with pytest.raises(NameTaken, match="shelf"):
        pose_store.teach("shelf", BENCH, DAY)
    assert pose_store.taught().poses["shelf"].joints == SHELF
    pose_store.teach("shelf", BENCH, DAY, replacing=True)
    assert pose_store.taught().poses["shelf"].joints == BENCH
    assert pose_store.taught().names == ("shelf", "bench")


def test_a_pallet_follows_the_poses_at_its_corners(pose_store: PoseStore) -> None:
    pose_store.teach_pallet("tray", GRID, DAY, 0.4)
    assert pose_store.taught().pallet("tray", 0.4).place(Cell(1, 1)) == MECHANISM.fk(SHELF)
    assert pose_store.taught().pallet("tray", 0.4).place(Cell(3, 1)) == Point(0.3, 1.2, 0.4)
    moved = SHELF._replace(a=0.45)
    pose_store.teach("shelf", moved, DAY, replacing=True)
    assert pose_store.taught().pallet("tray", 0.4).place(Cell(1, 1)) == MECHANISM.fk(moved)


def test_one_name_is_a_pose_or_a_pallet(pose_store: PoseStore) -> None:
    with pytest.raises(NameTaken):
        pose_store.teach_pallet("shelf", GRID, DAY, 0.4, replacing=True)
    pose_store.teach_pallet("tray", GRID, DAY, 0.4)
    with pytest.raises(NameTaken):
        pose_store.teach("tray", SHELF, DAY, replacing=True)
    pose_store.teach_pallet("tray", GRID.model_copy(update={"rows": 2}), DAY, 0.4, replacing=True)
    assert pose_store.taught().pallets["tray"].grid.rows == 2


@pytest.mark.parametrize(
    ("corners", "reason"),
    [
        (["shelf", "nowhere", "bench"], "'nowhere'.*no taught pose"),
        (["shelf", "slack", "bench"], "'slack'.*no taught pose with a place"),
        (["shelf", "shelf", "bench"], "the same place"),
    ],
)
def test_corners_that_span_nothing_are_not_taught(pose_store: PoseStore, corners: list[str], reason: str) -> None:
    pose_store.teach("slack", Joints(0.4, 0.6, 0.6), DAY)
    grid = Grid.model_validate({"corners": corners, "rows": 2, "columns": 2})
    with pytest.raises(InvalidValue, match=reason):
        pose_store.teach_pallet("tray", grid, DAY, 0.4)
    assert not pose_store.taught().pallets


def test_deleted_pose_is_gone_and_its_name_free(pose_store: PoseStore) -> None:
    pose_store.forget("shelf")
    assert pose_store.taught().names == ("bench",)
    pose_store.teach("shelf", BENCH, DAY)
    with pytest.raises(NotTaught, match=r"'tray'\. Known: bench, shelf"):
        pose_store.forget("tray")


def test_a_corner_is_not_forgotten_before_its_pallet(pose_store: PoseStore) -> None:
    pose_store.teach_pallet("tray", GRID, DAY, 0.4)
    with pytest.raises(InvalidValue, match="corner of the pallet tray"):
        pose_store.forget("shelf")
    pose_store.forget("tray")
    pose_store.forget("shelf")
    assert pose_store.taught().names == ("bench",)


def test_a_renamed_pose_is_still_the_corner_it_was(pose_store: PoseStore) -> None:
    pose_store.teach_pallet("tray", GRID, DAY, 0.4)
    pose_store.rename("shelf", "ledge")
    pose_store.rename("tray", "bandeja")
    assert pose_store.taught().names == ("ledge", "bench", "bandeja")
    assert pose_store.taught().pallets["bandeja"].grid.corners == ("ledge", "bench", (0.3, 1.2))
    assert pose_store.taught().pallet("bandeja", 0.4).place(Cell(1, 1)) == MECHANISM.fk(SHELF)


def test_a_name_is_not_renamed_onto_another(pose_store: PoseStore) -> None:
    with pytest.raises(NameTaken):
        pose_store.rename("shelf", "bench")
    with pytest.raises(NotTaught):
        pose_store.rename("tray", "tablet")
    with pytest.raises(InvalidValue):
        pose_store.rename("shelf", "2")


@pytest.mark.parametrize("name", ["", "2", "0.5", "-1", "tray[1,2]", "a b", "a/b", "x" * 65, "_a", "a\n", None, 3])
def test_ambiguous_name_is_refused(name: object) -> None:
    with pytest.raises(InvalidValue, match="a name is a letter"):
        checked_name(name)


@pytest.mark.parametrize("name", ["a", "tray.first", "año-2", "Ω_1", "next"])
def test_letters_of_any_language_make_names(pose_store: PoseStore, name: str) -> None:
    assert pose_store.teach(name, SHELF, DAY).name == checked_name(name)
    assert name in pose_store.taught().poses


@given(
    st.lists(st.tuples(*[st.floats(-10.0, 10.0)] * 3), min_size=1, max_size=5),
    st.text(st.characters(exclude_categories=["Cs"]), max_size=30),
)
def test_every_number_is_read_back_exactly(joints: list[tuple[float, float, float]], date: str) -> None:
    pose_store = PoseStore(MECHANISM)
    for number, values in enumerate(joints):
        pose_store.teach(f"pose{number}", Joints(*values), date)
    assert [(pose.joints, pose.taught) for pose in pose_store.taught().poses.values()] == [(it, date) for it in joints]


def test_pose_file_may_be_written_by_hand(path: Path) -> None:
    path.parent.mkdir()
    path.write_text(
        "[poses.shelf]  # no point, no date\njoints = {a = 0.4, b = 1.6, c = 1.3}\n"
        "[poses.bench]\njoints = [1, 1.5, 1.6]\ntaught = 2026-11-21T16:02:21Z\n"
        "[pallets.row]\ncorners = ['shelf', [0.3, 1.2]]\nrows = 1\ncolumns = 2\n",
        encoding="utf-8",
    )
    taught = PoseStore(MECHANISM, path).taught()
    assert taught.poses["shelf"].joints == SHELF
    assert taught.poses["bench"].taught == "2026-11-21 16:02:21+00:00"
    assert len(taught.pallet("row", 0.4)) == 2


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("[poses.shelf", "not TOML"),
        ("[poses.shelf]\njoints = [1, 2]", r"poses\.shelf\.joints: it must be \[a, b, c\]"),
        ("[poses.shelf]\njoints = [1, 2, inf]", r"poses\.shelf\.joints: 2: it must be a number between"),
        ("[poses.shelf]\njoints = [1, 2, 3]\ncolour = 1", r"poses\.shelf\.colour: "),
        ("[poses.'2']\njoints = [1, 2, 3]", r"poses\.2: a name is a letter"),
        ("[pallets.tray]\ncorners = [[1, 2]]\nrows = 2\ncolumns = 2", r"pallets\.tray: 2 x 2 cells have 3 to 4"),
        ("[poses.x]\njoints=[1,2,3]\n[pallets.x]\ncorners=[[1,2]]\nrows=1\ncolumns=1", "both a pose and a pallet"),
        ("tray = 3", "tray: "),
        ("poses = 3", "poses: "),
    ],
)
def test_broken_file_is_reported_and_left_alone(path: Path, text: str, reason: str) -> None:
    path.parent.mkdir()
    path.write_text(text, encoding="utf-8")
    pose_store = PoseStore(MECHANISM, path)
    with pytest.raises(FileUnreadable, match=reason):
        pose_store.taught()
    with pytest.raises(FileUnreadable):
        pose_store.teach("shelf", SHELF, DAY, replacing=True)
    assert path.read_text(encoding="utf-8") == text


@given(st.binary(max_size=200) | st.text("[]poses.x=\"'{}\n 1,-eiNnfa", max_size=60).map(str.encode))
def test_any_file_is_a_pose_store_or_reported(content: bytes) -> None:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "poses.toml"
        path.write_bytes(content)
        try:
            PoseStore(MECHANISM, path).taught()
        except FileUnreadable as error:
            assert "\n" not in str(error)


def test_unreadable_or_unwritable_file_is_reported(tmp_path: Path) -> None:
    with pytest.raises(FileUnreadable):
        PoseStore(MECHANISM, tmp_path).taught()
    (tmp_path / "file").write_text("")
    with pytest.raises((FileUnwritable, FileUnreadable)):
        PoseStore(MECHANISM, tmp_path / "file" / "poses.toml").teach("shelf", SHELF, DAY)


def test_a_link_to_the_file_stays_a_link(tmp_path: Path) -> None:
    (tmp_path / "kept").mkdir()
    (tmp_path / "poses.toml").symlink_to(tmp_path / "kept" / "poses.toml")
    PoseStore(MECHANISM, tmp_path / "poses.toml").teach("shelf", SHELF, DAY)
    assert (tmp_path / "poses.toml").is_symlink()
    assert PoseStore(MECHANISM, tmp_path / "kept" / "poses.toml").taught().names == ("shelf",)


def test_simultaneous_writers_lose_nothing(path: Path) -> None:
    def taught(name: str) -> str:
        with suppress(FileUnwritable):
            PoseStore(MECHANISM, path).teach(name, SHELF, DAY)
            return name
        return ""

    with ThreadPoolExecutor(8) as others:
        kept = set(others.map(taught, [f"pose{number}" for number in range(80)])) - {""}
    assert kept
    assert set(PoseStore(MECHANISM, path).taught().names) == kept
    assert [file.name for file in path.parent.iterdir()] == ["poses.toml"]


def test_draft_of_a_killed_writer_blocks_no_other(pose_store: PoseStore, path: Path) -> None:
    path.with_name(".poses.toml.new").symlink_to(path.with_name("elsewhere"))
    pose_store.teach("third", SHELF, DAY)
    assert [file.name for file in path.parent.iterdir()] == ["poses.toml"]


def test_permissions_stay(pose_store: PoseStore, path: Path) -> None:
    path.chmod(0o640)
    pose_store.teach("third", SHELF, DAY)
    assert path.stat().st_mode & 0o777 == 0o640


def test_a_pipe_does_not_hold_the_loop(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "poses.toml")
    with pytest.raises(FileUnreadable, match="it is no file"):
        PoseStore(MECHANISM, tmp_path / "poses.toml").taught()


def test_file_that_takes_long_to_read_is_neither_read_nor_written(pose_store: PoseStore, path: Path) -> None:
    path.write_text(path.read_text() + "#" * (MOST_BYTES - path.stat().st_size))
    assert pose_store.taught().names == ("shelf", "bench")
    path.write_text(path.read_text() + "#")
    with pytest.raises(FileUnreadable, match="larger than 250000 bytes"):
        pose_store.taught()


def test_file_stays_small_enough_to_read(path: Path) -> None:
    path.parent.mkdir()
    comment = "x" * (MOST_BYTES - 200)
    path.write_text(f"[poses.shelf]\njoints = [0.4, 1.6, 1.3]\ntaught = '{comment}'\n")
    before = path.read_text()
    with pytest.raises(FileUnwritable, match="larger"):
        PoseStore(MECHANISM, path).teach("bench", BENCH, DAY)
    assert path.read_text() == before
