"""A catkin workspace of this checkout's packages, built once and kept while what it is built from stays as it is."""

from __future__ import annotations

import fcntl
import hashlib
import json
import os
import shutil
import subprocess
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]
PACKAGES = ROOT / "ros"
PLACE = ROOT / "build" / "ros"
VENV_PYTHON = ROOT / ".venv-ros" / "bin" / "python"
WARM_PYTHON = ROOT / "tests" / "ros" / "warm_python"
BYTECODE = ROOT / "build" / "pycache"
"""Folder for compiled bytecode of test programs: outside the checkout, and kept between starts."""
KEPT = 8
"""Number of workspaces to keep; the oldest goes."""
USED_AS_IT_IS = {"launch", "urdf", "rviz", "resource", "rqt_config", "maya_ui"}
"""Folders that the devel space reads from the checkout, so that their changes need no new build."""
SYSTEM_PATH = "/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin"


def python() -> Path:
    """Return the Python of nodes: $MAYA_PYTHON, else that of .venv-ros."""
    return Path(os.environ.get("MAYA_PYTHON") or VENV_PYTHON)


def python_of_nodes() -> Path:
    """Return the Python that nodes are built for: `warm_python`, which forks them, if it stands for `python`."""
    return WARM_PYTHON if python() == VENV_PYTHON else python()


def missing() -> str | None:
    """Return why there is no ROS here, or None where there is one."""
    told = os.environ.get("MAYA_NO_ROS")
    if told:
        return told
    if not python().exists():
        return f"there is no {python()}; scripts/ros makes one"
    return None if shutil.which("roscore", path=SYSTEM_PATH) else "roscore is not installed; scripts/ros installs it"


def clean_environment() -> dict[str, str]:
    """Return an environment as a fresh login has it, with nothing of ROS and no other Python in it."""
    kept = {name: os.environ[name] for name in ("LANG", "TMPDIR", "USER") if name in os.environ}
    return {**kept, "PATH": SYSTEM_PATH, "HOME": str(Path.home())}


@dataclass(frozen=True, slots=True)
class Workspace:
    """A workspace that is built."""

    place: Path

    def environment(self, space: str = "devel") -> dict[str, str]:
        """Return what sourcing setup.bash of `space` makes of a clean environment."""
        return sourced(self.place / space / "setup.bash")


def sourced(setup: Path, *extensions: Path) -> dict[str, str]:
    """Return what sourcing a setup file, and then those of further workspaces, makes of a clean environment."""
    told = subprocess.run(
        ["/bin/bash", "-c", 'source "$0" && for more in "$@"; do source "$more" --extend; done && env -0', setup,
         *extensions],
        env=clean_environment(),
        stdout=subprocess.PIPE,
        text=True,
        check=True,
    )  # fmt: skip
    pairs = (entry.split("=", 1) for entry in told.stdout.split("\0") if entry)
    return {name: value for name, value in pairs if name not in {"_", "PWD", "OLDPWD", "SHLVL"}}


def provide() -> Workspace:
    """Return the workspace for the packages as they are now; build and install them if that is not done yet."""
    PLACE.mkdir(parents=True, exist_ok=True)
    (PLACE / "CATKIN_IGNORE").touch()  # this checkout may lie in a workspace itself
    workspace = PLACE / fingerprint()
    with (PLACE / "lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not (workspace / "built").exists():
            shutil.rmtree(workspace, ignore_errors=True)
            _forget_old_ones()
            link_packages(workspace)
            make(workspace)
            (workspace / "built").touch()
    return Workspace(workspace)


def make(workspace: Path) -> None:
    """Build and install the packages in a folder of their own, with messages for Python alone."""
    quick = {"ROS_LANG_DISABLE": "gencpp:geneus:genlisp:gennodejs", "MAYA_PYTHON": str(python_of_nodes())}
    run(("catkin_make", "--no-color", "install"), workspace, quick)


def run(command: Sequence[str], place: Path, more: Mapping[str, str] | None = None) -> str:
    """Run a command in a clean environment, `more` laid over it, and return its output; fails if the command fails."""
    done = subprocess.run(
        command, cwd=place, env={**clean_environment(), **(more or {})}, stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, f"{' '.join(command)} ended with {done.returncode}:\n{done.stdout}"
    return done.stdout


def outputs_of(module: str, text: str = "") -> list[Any]:
    """Run a module of the tests in the Python of nodes, with `text` as its input; return its output, JSON lines."""
    environment = provide().environment()
    environment["PYTHONPATH"] = f"{ROOT}:{environment.get('PYTHONPATH', '')}"
    done = subprocess.run(
        [python(), "-m", module], input=text, env=environment, stdout=subprocess.PIPE, text=True, check=True
    )
    return [json.loads(line) for line in done.stdout.splitlines()]


def link_packages(workspace: Path) -> None:
    """Put the packages into a workspace, following the README."""
    source = workspace / "src"
    source.mkdir(parents=True)
    (source / "maya").symlink_to(PACKAGES)


def fingerprint() -> str:
    """Return a hash of everything that a build reads."""
    parts = hashlib.sha256(f"{ROOT} {python_of_nodes()}".encode())
    for path in sorted(_sources()):
        parts.update(f"\n{path.relative_to(PACKAGES)} ".encode() + path.read_bytes())
    return parts.hexdigest()[:16]


def _sources() -> Iterator[Path]:
    for path in PACKAGES.rglob("*"):
        parts = path.relative_to(PACKAGES).parts
        steers = path.name in {"package.xml", "CMakeLists.txt", "setup.py"}
        read = not USED_AS_IT_IS & set(parts) and "__pycache__" not in parts
        if path.is_file() and (steers or read):
            yield path


def _forget_old_ones() -> None:
    places = sorted((path for path in PLACE.iterdir() if path.is_dir()), key=lambda path: path.stat().st_mtime)
    for old in places[: -KEPT + 1]:
        shutil.rmtree(old, ignore_errors=True)
