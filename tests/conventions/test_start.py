"""The command line starts fast: frequent commands import next to nothing."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

HEAVY = {
    "PIL",
    "asyncio",
    "cbor2",
    "fastapi",
    "httpx",
    "importlib.metadata",
    "matplotlib",
    "maya_un.controller",
    "maya_un.kinematics",
    "maya_un.machine",
    "dmc41x3.twin",
    "numpy",
    "pydantic",
    "rich",
    "scipy",
    "typer",
    "uvicorn",
    "yaml",
}
PROGRAM = """
import json, sys
from maya_un.cli.main import main
sys.argv[0] = "maya"
try:
    main()
except SystemExit:
    pass
print(json.dumps(sorted(sys.modules)), file=sys.stderr)
"""


FREQUENT = [
    "--help",
    "--version",
    "status",
    "stop",
    "stop --address 127.0.0.1:1",
    "stop --address /dev/no-such-port",
    "fk 0.5 1.5 1.5",
    "ik 0.5 1.1 0.9",
    "reach 0.5 1.1 0.9",
]
PARSED = ["queue", "job list", "pick 0.5 1.1"]
"""Command lines that need the parser of all commands, and a service."""

ONLY_PARSED = ["run --help", "config --help", "pick"]
"""Command lines that need nothing but the parser."""


@pytest.mark.parametrize("line", FREQUENT)
def test_a_frequent_command_imports_nothing_heavy(line: str, tmp_path: Path) -> None:
    light = {"maya_un.kinematics"} if line.split(maxsplit=1)[0] in {"fk", "ik", "reach"} else set[str]()
    assert heavy(line, tmp_path) - light == set()


@pytest.mark.parametrize("line", ["--help", "--version", "status", "stop"])
def test_the_fastest_commands_define_no_dataclass(line: str, tmp_path: Path) -> None:
    assert imported(line, tmp_path) & {"dataclasses", "inspect"} == set()


@pytest.mark.parametrize("line", PARSED)
def test_a_parsed_command_imports_nothing_of_the_robot(line: str, tmp_path: Path) -> None:
    assert heavy(line, tmp_path) - {"asyncio", "typer"} == set()


@pytest.mark.parametrize("line", ONLY_PARSED)
def test_help_of_a_command_imports_only_the_parser(line: str, tmp_path: Path) -> None:
    loaded = imported(line, tmp_path)
    assert HEAVY & loaded == {"typer"}
    assert {name for name in loaded if name.startswith("maya_un.schema.")} == {"maya_un.schema.choices"}


def test_the_link_to_supervisors_loads_no_robot_and_no_service() -> None:
    """`maya coms` runs beside the robot all day."""
    program = "import json, sys, maya_un.cli.coms.run; print(json.dumps(sorted(sys.modules)))"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    known = set(json.loads(done.stdout))
    assert known & {"numpy", "mcap", "prometheus_client", "fastapi", "maya_un.service.service"} == set()
    assert "maya_un.coms.agent" in known


def heavy(line: str, tmp_path: Path) -> set[str]:
    """Return the heavy modules that a command line imports."""
    return HEAVY & imported(line, tmp_path)


def imported(line: str, tmp_path: Path) -> set[str]:
    """Return the modules that a command line imports."""
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM, *line.split()],
        env={
            **os.environ,
            "MAYA_RUNTIME_DIR": str(tmp_path),
            "XDG_RUNTIME_DIR": str(tmp_path),
            "XDG_CONFIG_HOME": str(tmp_path),
            "MAYA_CONFIG": "",
        },
        capture_output=True,
        text=True,
        check=True,
    )
    return set(json.loads(done.stderr.splitlines()[-1]))
