"""Availability of a browser on a system, and the reasons against it, for ./test."""

from __future__ import annotations

import subprocess
from pathlib import Path

from tests.conventions.source import ROOT
from tests.conventions.test_ros_setup import KNOWS_NOT, program, system
from tests.dashboard.tabs import BROWSER

__all__ = ["system"]

ASK = 'root=$0; . "$0/scripts/setup.sh"; if browser_can_be; then echo yes; else echo "$no_browser"; fi'


def answer_for(system: Path) -> str:
    done = subprocess.run(
        ["/bin/sh", "-euc", ASK, ROOT], env={"PATH": str(system)}, capture_output=True, text=True, check=True
    )
    assert done.stderr == ""
    return done.stdout.strip()


def test_installed_browser_is_not_searched(system: Path) -> None:
    program(system, BROWSER, "exit 9")
    program(system, "apt-get", "exit 9")
    assert answer_for(system) == "yes"


def test_without_apt_there_is_no_browser(system: Path) -> None:
    assert answer_for(system) == f"there is no apt-get here, which {BROWSER} would come from"


def test_user_who_may_not_install_gets_no_browser(system: Path) -> None:
    program(system, "apt-get", "exit 0")
    program(system, "id", "echo 1000")
    assert answer_for(system) == f"{BROWSER} is missing, and neither root nor sudo is at hand"


def test_system_without_the_package_gets_no_browser(system: Path, tmp_path: Path) -> None:
    program(system, "apt-get", f"echo updated >>{tmp_path}/updates")
    program(system, "apt-cache", KNOWS_NOT)
    assert answer_for(system) == f"this system has no package {BROWSER}"
    assert (tmp_path / "updates").read_text() == "updated\n"


def test_package_of_the_browser_can_be_installed(system: Path) -> None:
    program(system, "apt-get", "exit 9")
    program(system, "apt-cache", "echo Package: x; echo Version: 156.0.1-1~deb12u1")
    assert answer_for(system) == "yes"
