"""The packages build by both of ROS' tools, are installed, and lint finds nothing."""

from __future__ import annotations

import json
import os
from pathlib import Path

import pytest

from maya_ros.ros1.constants import constants
from maya_un.config.files import parse
from tests.ros import workspace as workspaces
from tests.ros.workspace import PACKAGES, ROOT, Workspace, python, python_of_nodes, run, sourced

NODES = {
    "maya_controller": {"hw_simulator.py", "hardware_interface.py", "sensor_converter.py", "on_display.py"},
    "maya_robot": {"robot_controller.py", "primitive_server.py"},
    "maya_process": {"process_controller.py", "firebase_bridge.py", "rosbridge.py"},
}
BUILD_TIME = 400
"""Wall limit of a whole build [s]: two cores, which others use as well."""


def programs(space: Path) -> dict[str, set[str]]:
    """Return the programs of the packages in a devel or install space."""
    return {name: {path.name for path in (space / "lib" / name).glob("*.py")} for name in NODES}


def test_catkin_lint_finds_nothing() -> None:
    # catkin 0.8.0 takes no metapackage that asks for a newer CMake than 2.8.3
    said = run(["catkin_lint", "-W2", "--strict", "--offline", "--ignore", "cmake_ancient", str(PACKAGES)], ROOT)
    assert "found 0 problems" in said


def test_nodes_are_in_the_devel_space_under_the_python_that_has_maya(workspace: Workspace) -> None:
    made = programs(workspace.place / "devel")
    assert all(NODES[name] <= made[name] for name in NODES)
    for name in NODES:
        for path in (workspace.place / "devel" / "lib" / name).glob("*.py"):
            assert path.read_text().startswith(f"#!{python_of_nodes()}\n")
            assert os.access(path, os.X_OK)


def test_installed_files_need_no_source(workspace: Workspace, other_python: str) -> None:
    space = workspace.place / "install"
    assert all(NODES[name] <= made for name, made in programs(space).items())
    environment = {**sourced(space / "setup.bash"), "PATH": other_python}
    assert run(["rospack", "find", "maya_process"], space, environment).strip() == str(space / "share/maya_process")
    for name in ("controller/launch/controller.launch", "controller/urdf/maya_robot.xacro", "ui/plugin.xml"):
        assert (space / "share" / f"maya_{name}").exists()
    told = run(["/usr/bin/python3", "-c", CONSTANTS], space, environment)
    assert json.loads(told) == constants(parse({}))


CONSTANTS = """
import json
from maya_controller.config import constants
print(json.dumps({name: value for name, value in vars(constants).items() if name.isupper()}))
"""


def test_a_plain_python_of_ros_reads_the_constants_of_the_configuration(workspace: Workspace, tmp_path: Path) -> None:
    file = tmp_path / "maya.toml"
    file.write_text("[geometry]\nheight = 2.5\n")
    environment = {**workspace.environment(), "MAYA_CONFIG": str(file)}
    told = json.loads(run(["/usr/bin/python3", "-c", CONSTANTS], tmp_path, environment))
    assert told == {**constants(parse({})), "MAYA_HEIGHT": 2.5}


def test_constants_without_a_configuration_are_an_import_error_that_says_why(
    workspace: Workspace, tmp_path: Path
) -> None:
    environment = {**workspace.environment(), "MAYA_CONFIG": str(tmp_path / "missing.toml")}
    with pytest.raises(AssertionError, match=r"ImportError: the constants cannot be read: .*missing\.toml"):
        run(["/usr/bin/python3", "-c", CONSTANTS], tmp_path, environment)


def test_an_event_is_read_by_a_plain_python(workspace: Workspace) -> None:
    program = "from maya_controller.config import events; print(events.read('idle {\"homed\":true}'))"
    assert (
        run(["/usr/bin/python3", "-c", program], ROOT, workspace.environment()).strip() == "('idle', {'homed': True})"
    )


MODULES = """
import asyncio
from maya_controller.simulation.virtual_maya import virtual_maya
from maya_robot.inv_kin_calculator import joints, place
from maya_robot.model import model
from maya_un.errors import Unreachable
there = place(*joints(0.5, 1.2, 0.4))
assert max(abs(one - other) for one, other in zip(there, (0.5, 1.2, 0.4))) < 1e-12, there
def refused(call, *values):
    try:
        return "" if call(*values) else ""
    except Unreachable as refusal:
        return refusal.details["reason"]
for call, *values in (joints, 0.5, 1.2, 2.2), (joints, 0.1, 0.3, 0.4), (joints, -0.2, 1.1, 0.4), (place, 0.4, 3.0, 3.0):
    assert refused(call, *values), values
assert model().mechanism.height == 2.35
async def parts():
    return virtual_maya(parts={"block": there}).mechanics.parts
assert asyncio.run(parts()) == {"block": there}
"""


def test_the_manuals_modules_are_there_for_the_python_of_nodes(workspace: Workspace) -> None:
    run([str(python()), "-c", MODULES], ROOT, workspace.environment())


def test_a_checkout_within_a_workspace_holds_each_package_once(workspace: Workspace) -> None:
    crawl = f"from catkin_pkg.packages import find_package_paths; print(*sorted(find_package_paths({str(ROOT)!r})))"
    found = run(["/usr/bin/python3", "-c", crawl], workspace.place).split()
    assert found == [
        f"ros/{name}" for name in ("maya_controller", "maya_process", "maya_robot", "maya_ros_un", "maya_ui")
    ]


@pytest.mark.timeout(BUILD_TIME)
@pytest.mark.parametrize("left_out", ["geneus:genlisp:gennodejs", pytest.param("", marks=pytest.mark.long)])
def test_one_command_makes_a_workspace_by_catkin_build_with_any_python_first(
    tmp_path: Path, other_python: str, left_out: str
) -> None:
    """With messages for C++ and Python; those for all languages take twice as long."""
    if workspaces.python() != ROOT / ".venv-ros" / "bin" / "python":
        pytest.skip("scripts/ros builds for .venv-ros, and $MAYA_PYTHON names another")
    place = tmp_path / "catkin_ws"
    said = run(
        [str(ROOT / "scripts" / "ros"), str(place)], tmp_path, {"PATH": other_python, "ROS_LANG_DISABLE": left_out}
    )
    assert "packages succeeded!" in said
    assert " complete] " not in said  # without a terminal, progress lines are left out
    assert f"Ready: source {place}/devel/setup.bash" in said
    made = programs(place / "devel")
    assert all(NODES[name] <= made[name] for name in NODES)


@pytest.mark.timeout(BUILD_TIME)
def test_without_a_python_for_nodes_the_build_gives_advice(tmp_path: Path) -> None:
    configure = ["cmake", str(PACKAGES / "maya_controller")]
    with pytest.raises(AssertionError, match=r"(?s)/nowhere/python\s+cannot run Maya's nodes.*scripts/ros"):
        run(configure, tmp_path, {"MAYA_PYTHON": "/nowhere/python"})
    said = run([*configure, "-DMAYA_MESSAGES_ONLY=ON"], tmp_path, {"MAYA_PYTHON": "/nowhere/python"})
    assert "Configuring done" in said
    assert not list(tmp_path.glob("devel/lib/maya_controller/*.py"))
