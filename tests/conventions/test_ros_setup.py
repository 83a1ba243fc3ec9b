"""Availability of a ROS on a system, and the reasons against it, for ./test and scripts/ros."""

from __future__ import annotations

import os
import shutil
import subprocess
from pathlib import Path

import pytest

from tests.conventions.source import ROOT

ASK = 'root=$0; . "$0/scripts/setup.sh"; if ros_can_be xvfb; then echo yes; else echo "$no_ros"; fi'
NEEDED = ("sh", "sed", "grep", "env", "printf")
KNOWS = "exit 0"
KNOWS_NOT = "exit 100"


def python_is_old() -> bool:
    """Tell whether the Python that ROS would use is there, and too old."""
    old = ["/usr/bin/python3", "-c", "import sys; sys.exit(sys.version_info < (3, 11))"]
    return os.access(old[0], os.X_OK) and subprocess.run(old, check=False).returncode != 0


needs_new_python = pytest.mark.skipif(python_is_old(), reason="/usr/bin/python3 is older than 3.11")


@pytest.fixture
def system(tmp_path: Path) -> Path:
    """Return a folder of programs that is a whole system: nothing is installed there, and root is at work."""
    place = tmp_path / "bin"
    place.mkdir()
    for name in NEEDED:
        found = shutil.which(name)
        assert found is not None
        (place / name).symlink_to(found)
    program(place, "dpkg-query", "exit 1")
    program(place, "id", "echo 0")
    return place


def program(place: Path, name: str, script: str) -> None:
    file = place / name
    file.write_text(f"#!/bin/sh\n{script}\n")
    file.chmod(0o755)


def answer_for(system: Path) -> str:
    done = subprocess.run(
        ["/bin/sh", "-euc", ASK, ROOT], env={"PATH": str(system)}, capture_output=True, text=True, check=True
    )
    assert done.stderr == ""
    return done.stdout.strip()


def test_installed_packages_are_not_searched(system: Path) -> None:
    program(system, "dpkg-query", 'shift 3; for name in "$@"; do echo "installed $name"; done')
    program(system, "apt-get", "exit 9")
    assert answer_for(system) == "yes"


def test_without_apt_ros_is_unavailable(system: Path) -> None:
    assert answer_for(system) == "there is no apt-get here, which packages of ROS 1 would come from"


def test_user_who_may_not_install_gets_a_message(system: Path) -> None:
    program(system, "apt-get", KNOWS)
    program(system, "id", "echo 1000")
    assert answer_for(system) == "packages of ROS 1 are missing, and neither root nor sudo is at hand"


@needs_new_python
def test_system_without_packages_is_checked_again_after_an_update(system: Path, tmp_path: Path) -> None:
    program(system, "apt-get", f"echo updated >>{tmp_path}/updates")
    program(system, "apt-cache", KNOWS_NOT)
    assert answer_for(system) == "no ROS 1 is packaged for this system: apt-get knows no python3-rospy"
    assert (tmp_path / "updates").read_text() == "updated\n"


@needs_new_python
def test_a_bare_system_learns_of_it_by_the_update(system: Path, tmp_path: Path) -> None:
    program(system, "apt-get", f": >{tmp_path}/updated")
    program(system, "apt-cache", f"[ -f {tmp_path}/updated ]")
    assert answer_for(system) == "yes"


def offered(system: Path) -> str:
    """Return what scripts/ros says of rqt, not at a terminal."""
    done = subprocess.run(
        ["/bin/sh", "-euc", 'root=$0; . "$0/scripts/setup.sh"; offer_rqt', ROOT],
        env={"PATH": str(system)}, stdin=subprocess.DEVNULL, capture_output=True, text=True, check=True,
    )  # fmt: skip
    return done.stderr.strip()


def test_packages_of_rqt_are_offered_where_apt_knows_them(system: Path) -> None:
    known = "ros-noetic-rqt | ros-noetic-rqt-rviz | ros-noetic-rqt-topic"
    program(system, "apt-cache", f"case $2 in {known}) echo Version: 0.5.5 ;; *) exit 100 ;; esac")
    command = "apt-get install ros-noetic-rqt ros-noetic-rqt-rviz ros-noetic-rqt-topic"
    assert offered(system) == f"rqt is not installed. To install it: {command}"


@pytest.mark.parametrize("apt", [True, False])
def test_a_system_without_packages_of_rqt_says_how_to_build_it(system: Path, *, apt: bool) -> None:
    if apt:
        program(system, "apt-cache", KNOWS_NOT)
    (said,) = offered(system).splitlines()
    assert "opens in its own window" in said
    assert said.endswith("how to build rqt: docs/how-to/use-the-dashboard-in-rqt.md")


def test_installed_rqt_is_not_offered(system: Path) -> None:
    program(system, "rqt", "exit 9")
    program(system, "apt-cache", "echo Version: 0.5.5")
    assert offered(system) == ""
