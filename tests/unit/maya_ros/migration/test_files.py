"""`maya migrate` on a workspace in the style of the original, and on input that is no script."""

from __future__ import annotations

import json
import os
import shutil
import socket
import time
from pathlib import Path

import pytest

from maya_ros.migration import files
from maya_ros.migration.files import LARGEST, check
from maya_ros.migration.original import PYTHON_2
from maya_un.cli.main import main
from maya_un.errors import FileUnreadable

HERE = Path(__file__).parent
WORKSPACE = HERE / "original"
"""Scripts in the style of the manual's listings; their names end in .txt, so that no tool takes them for ours."""
GOLDEN = HERE / "findings.txt"


@pytest.fixture
def workspace(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Copy the scripts of the original to a folder `ws` in the present one."""
    for source in sorted(WORKSPACE.rglob("*.txt")):
        target = tmp_path / "ws" / source.relative_to(WORKSPACE).with_suffix("")
        target.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(source, target)
    monkeypatch.chdir(tmp_path)
    return tmp_path / "ws"


def test_findings_in_the_original_are_the_golden(workspace: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """To renew it after a review: run `maya migrate ws` in a copy, and store the output."""
    before = {path: path.read_bytes() for path in workspace.rglob("*") if path.is_file()}
    assert main(["migrate", "ws"]) == 1
    assert capsys.readouterr().out == GOLDEN.read_text(encoding="utf-8")
    assert {path: path.read_bytes() for path in workspace.rglob("*") if path.is_file()} == before


def test_json_has_the_same_findings(workspace: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert workspace.is_dir()
    assert main(["migrate", "ws", "--json"]) == 1
    data = json.loads(capsys.readouterr().out)
    golden = GOLDEN.read_text(encoding="utf-8")
    shown = [one for one in data["findings"] if one["why"]]
    marks = {"change": "", "check": " (check)", "same": ""}
    lines = [
        f"{one['file']}:{one['line']}: {one['found']}{marks[one['kind']]}\n    {one['why']}\n    {one['instead']}\n"
        for one in shown
    ]
    assert golden.startswith("".join(lines))
    assert {one["kind"] for one in data["findings"]} == {"change", "check", "same"}
    assert data["unread"] == []


def test_the_syntax_of_python_2_is_found_in_every_file_that_a_script_of_the_original_may_import(
    tmp_path: Path,
) -> None:
    ws, other = tmp_path / "ws", tmp_path / "other"
    for folder in (ws / "lib", other):
        folder.mkdir(parents=True)
    (ws / "main.py").write_text("import rospy\nimport helper\n")
    for place in (ws / "helper.py", ws / "lib" / "tools.py", other / "hello.py"):
        place.write_text('print "hi"\n')
    (ws / "fine.py").write_text('print("hi")\n')
    report = check(str(tmp_path))
    found = {Path(file).name for file, one in report.findings if one.rule is PYTHON_2}
    assert found == {"helper.py", "tools.py"}
    assert report.files == 5


NEW = """\
import math
import rospy
from std_msgs.msg import String
from maya_controller.config import events
from maya_controller.msg import MoveGoal
from maya_robot.msg import MayaPrimitive

def heard(msg):
    if msg.data == events.HOMED or events.read(msg.data)[0] == "idle":
        print("ok")

rospy.Subscriber("/maya_event", String, heard)
goal = MoveGoal(a=math.radians(30), b=1.5, c=1.2)
task = MayaPrimitive(command=MayaPrimitive.PICK)
task.target.x = 0.4
"""


def test_a_program_that_needs_no_change_ends_with_0(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "new.py").write_text(NEW)
    assert main(["migrate", str(tmp_path)]) == 0
    said = capsys.readouterr().out
    assert "1 files read: 0 places to change, 0 to check, 0 files not read." in said
    assert "Works as before: /maya_event, events.HOMED," in said


def reason(path: Path) -> str:
    """Return why a path cannot be read."""
    with pytest.raises(FileUnreadable) as refused:
        check(str(path))
    return str(refused.value.details["reason"])


def test_a_file_that_is_no_text_is_refused_with_a_sentence(tmp_path: Path) -> None:
    for name in ("tool.py", "photo.jpg", "program"):
        (tmp_path / name).write_bytes(b"\x7fELF maya \0\1\2" + bytes(range(256)) * 40)
        assert reason(tmp_path / name) == "it is no text, but binary data"
    (tmp_path / "notes.odt").write_text("maya")
    assert reason(tmp_path / "notes.odt") == "it is no script, launch file, definition or DMC program"


def test_a_large_file_is_refused_at_once(tmp_path: Path) -> None:
    large = tmp_path / "large.py"
    large.write_text("import maya_robot\n" * 590_000)
    begin = time.process_time()
    assert reason(large) == "it has 10.6 MB; at most 256 kB are read"
    assert time.process_time() - begin < 1.0


def test_a_folder_is_read_around_what_is_no_script(tmp_path: Path) -> None:
    (tmp_path / "scan.bag").write_bytes(b"\0maya" * 1000)
    (tmp_path / "large.py").write_text("import maya_robot\n" * 60_000)
    (tmp_path / "binary.py").write_bytes(b"maya\0")
    (tmp_path / "binary").write_bytes(b"maya\0")
    (tmp_path / "latin.py").write_bytes(
        "# coding: latin-1\nnombre = 'mu\xf1eca'\nimport maya_robot.nothing\n".encode("latin-1")
    )
    (tmp_path / "loop").symlink_to(tmp_path)
    (tmp_path / "self.py").symlink_to(tmp_path / "self.py")
    (tmp_path / "gone.py").symlink_to(tmp_path / "nowhere.py")
    os.mkfifo(tmp_path / "pipe.py")
    report = check(str(tmp_path))
    assert {(Path(one.file).name, one.reason) for one in report.unread} == {
        ("large.py", "it has 1.1 MB; at most 256 kB are read"),
        ("binary.py", "it is no text, but binary data"),
        ("self.py", "Too many levels of symbolic links"),
        ("gone.py", "No such file or directory"),
        ("pipe.py", "it is no regular file"),
    }
    assert [(Path(file).name, one.line, one.key) for file, one in report.findings] == [("latin.py", 3, "module")]
    assert not report.clean


def test_a_folder_without_scripts_has_nothing_to_change(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "model.stl").write_bytes(b"\0" * 100)
    (tmp_path / "empty").mkdir()
    assert main(["migrate", str(tmp_path)]) == 0
    assert capsys.readouterr().out == "0 files read: 0 places to change, 0 to check, 0 files not read.\n"


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("missing.py", "No such file or directory"),
        ("circle", "Too many levels of symbolic links"),
        ("a\0b", "null byte"),
    ],
)
def test_a_path_that_is_no_file_is_refused_with_a_sentence(name: str, expected: str, tmp_path: Path) -> None:
    (tmp_path / "circle").symlink_to(tmp_path / "circle")
    assert expected in reason(tmp_path / name)


def test_a_socket_is_refused_with_a_sentence(tmp_path: Path) -> None:
    with socket.socket(socket.AF_UNIX) as listener:
        listener.bind(str(tmp_path / "s.py"))
        assert reason(tmp_path / "s.py") == "No such device or address"


def test_an_unreadable_file_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """As root every file can be read, so the system's refusal comes from a replaced function."""
    (tmp_path / "secret.py").write_text("import maya_robot\n")

    def refuse(*_: object) -> int:
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(files.os, "open", refuse)
    assert [one.reason for one in check(str(tmp_path)).unread] == ["Permission denied"]
    assert reason(tmp_path / "secret.py") == "Permission denied"


HOSTILE = {
    "nested.py": "maya = " + "(" * 50_000,
    "brackets.py": "maya = " + "[" * 90 + "]" * 90,
    "quotes.py": "maya = '''" + "a" * 200_000,
    "prints.py": "maya = 1\n" + "print x\n" * 25_000,
    "deep.py": "maya = 1\n" + "".join(" " * depth + "if x:\n" for depth in range(600)),
    "long.sh": "maya " + "roslaunch x " * 18_000,
    "slash.sh": "maya \\\n" * 30_000,
    "many.dmc": "MG 1;" * 40_000,
    "laughs.launch": '<!DOCTYPE l [<!ENTITY a "aaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaa">'
    + "".join(f'<!ENTITY {b} "{f"&{a};" * 20}">' for a, b in zip("abcdefg", "bcdefgh", strict=True))
    + "]><launch>&h;</launch>",
    "open.launch": "<launch>" * 20_000,
    "wide.msg": "maya_robot/X x\n" * 15_000,
}


@pytest.mark.parametrize("name", HOSTILE)
def test_hostile_input_ends_within_a_bounded_time(name: str, tmp_path: Path) -> None:
    assert len(HOSTILE[name]) < LARGEST
    (tmp_path / name).write_text(HOSTILE[name])
    begin = time.process_time()
    check(str(tmp_path))
    assert time.process_time() - begin < 20.0


def test_only_packages_of_the_original_and_of_users_are_read(tmp_path: Path) -> None:
    manifest = "<package><name>maya_robot</name><maintainer>{}</maintainer></package>"
    for folder, maintainer in (("ours", "The maintainers of Maya-UN"), ("old", "A student")):
        (tmp_path / folder / "src").mkdir(parents=True)
        (tmp_path / folder / "package.xml").write_text(manifest.format(maintainer))
        (tmp_path / folder / "src" / "a.py").write_text("import maya_robot.primitive_server\n")
    found = [(str(Path(file).relative_to(tmp_path)), one.key) for file, one in check(str(tmp_path)).findings]
    assert found == [("old/package.xml", "old-package"), ("old/src/a.py", "module")]


def test_every_manifest_of_ours_names_its_maintainers() -> None:
    manifests = [*(HERE.parents[3] / "ros").glob("*/package.xml")]
    assert len(manifests) == 5
    assert all(files._OURS in path.read_bytes() for path in manifests)


def test_a_folder_with_too_much_ends_with_one_sentence(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(files, "MOST_BYTES", 1000)
    for number in range(30):
        (tmp_path / f"{number:02}.sh").write_text("roslaunch maya_robot robot.launch\n" * 10)
    report = check(str(tmp_path))
    assert (report.files, [Path(one.file).name for one in report.unread]) == (3, ["02.sh"])


def test_pages_have_only_their_commands_read(tmp_path: Path) -> None:
    (tmp_path / "page.md").write_text(
        "ros-coms needs galilsuite.\n```sh\nroslaunch maya_ui x.launch\n```\nroslaunch maya_ui y.launch\n"
        "- $ roscd maya_process/src/ros-coms\n- $ yarn start\n"
    )
    found = [(one.line, one.key) for _, one in check(str(tmp_path)).findings]
    assert found == [(3, "launch-file"), (6, "ros-coms"), (7, "ros-coms")]
