"""The files around the source: commands, locks, records, pages."""

from __future__ import annotations

import os
import re
import subprocess
import sys
import tomllib
from importlib.metadata import version

import pytest

import dmc41x3
import maya_un
from dmc41x3.twin.commands import COVERAGE, CoverageClass
from tests.conventions.source import PACKAGES, ROOT

COMMANDS = ["run", "test"] + [
    f"scripts/{name}" for name in ("test-fast", "check", "bench", "docs", "gen", "ros", "web")
]
LOCKS = ["requirements.lock", "requirements-dev.lock", "requirements-clients.lock", "requirements-peers.lock"]
RECORDS = sorted((ROOT / "docs" / "decisions").glob("[0-9]*.md"))


def text(name: str) -> str:
    return (ROOT / name).read_text(encoding="utf-8")


def pins(lock: str) -> dict[str, str]:
    return dict(re.findall(r"^([a-z0-9.-]+)==(\S+)", text(lock), re.MULTILINE))


@pytest.mark.parametrize("name", COMMANDS)
def test_a_command_is_executable_plain_shell(name: str) -> None:
    assert os.access(ROOT / name, os.X_OK)
    assert text(name).startswith("#!/bin/sh\n")
    subprocess.run(["/bin/sh", "-n", ROOT / name], check=True)


def test_tests_listed_as_slow_exist() -> None:
    """One that was renamed would run with the fast ones again."""
    for line in text("tests/slow.txt").splitlines():
        path, _, name = line.removeprefix("--ignore=").removeprefix("--deselect=").partition("::")
        assert path.startswith("tests/"), line
        assert re.search(rf"^(async )?(def |class )?{name}\b", text(path), re.MULTILINE), line


def test_continuous_integration_checks_first_and_closes_with_the_tests() -> None:
    steps = re.findall(r"^ *(scripts/\w+|\./test)", text(".ci/run"), re.MULTILINE)
    assert os.access(ROOT / ".ci" / "run", os.X_OK)
    assert steps == ["scripts/check", "./test"]


@pytest.mark.parametrize("lock", LOCKS)
def test_a_lock_pins_hashes_and_names_no_server(lock: str) -> None:
    entries = re.split(r"\n(?=[a-z0-9.-]+==)", text(lock))[1:]
    assert [entry for entry in entries if "--hash=sha256:" not in entry] == []
    assert not re.search(r"://|--(index|extra-index|find-links|trusted)", text(lock))


def test_the_development_lock_contains_the_other() -> None:
    assert pins("requirements.lock").items() <= pins("requirements-dev.lock").items()


def test_locks_hold_the_requirements_of_the_project() -> None:
    project = tomllib.loads(text("pyproject.toml"))["project"]
    extras = project["optional-dependencies"]
    run = project["dependencies"] + extras["build"]
    peers = re.findall(r"^[a-z][\w-]*", text("requirements-peers.in"), re.MULTILINE)
    asked = {
        "requirements.lock": run,
        "requirements-dev.lock": extras["dev"],
        "requirements-peers.lock": run + peers,
    }
    for lock, requirements in asked.items():
        names = {re.split(r"[<>=!~\[ ;]", requirement)[0] for requirement in requirements}
        assert names <= pins(lock).keys(), f"run scripts/gen: {lock} lacks {names - pins(lock).keys()}"


def test_generated_pages_are_current() -> None:
    check = subprocess.run(
        [sys.executable, ROOT / "scripts" / "gen_docs.py", "--check"], capture_output=True, text=True, check=False
    )
    assert check.returncode == 0, check.stdout + check.stderr


def test_records_are_numbered_without_a_gap() -> None:
    assert [int(record.name[:4]) for record in RECORDS] == list(range(1, len(RECORDS) + 1))


def test_records_have_context_decision_and_consequences() -> None:
    for record in RECORDS:
        page = record.read_text(encoding="utf-8")
        assert page.startswith(f"# {int(record.name[:4])}. "), record
        assert re.findall(r"^## (.*)$", page, re.MULTILINE) == ["Context", "Decision", "Consequences"], record


def test_links_between_pages_lead_somewhere() -> None:
    for page in (ROOT / "docs").rglob("*.md"):
        targets = re.findall(r"\]\(([^)#:]+)(?:#[^)]*)?\)", page.read_text(encoding="utf-8"))
        assert [target for target in targets if not (page.parent / target).exists()] == [], page


def test_the_changelog_has_a_place_for_the_next_change() -> None:
    assert re.search(r"^## \[Unreleased\]$", text("CHANGELOG.md"), re.MULTILINE)


def test_the_readme_starts_with_the_two_commands() -> None:
    blocks = re.findall(r"```(?:sh|bash|console)?\n(.*?)```", text("README.md"), re.DOTALL)
    commands = [word for block in blocks for word in re.findall(r"^(?:\$ )?(\./\w+)", block, re.MULTILINE)]
    assert sorted(set(commands)) == ["./run", "./test"]


def test_every_page_is_found_from_the_index_of_the_documentation() -> None:
    folders = ("tutorials", "how-to", "reference", "explanation")
    pages = [
        page for folder in folders for page in (ROOT / "docs" / folder).iterdir() if page.suffix in {".md", ".ipynb"}
    ]
    index = text("docs/README.md")
    assert [page.name for page in pages if f"({page.parent.name}/{page.name})" not in index] == []


def test_readme_states_the_coverage_of_the_language() -> None:
    done = sum(coverage.kind is CoverageClass.IMPLEMENTED for coverage in COVERAGE.values())
    assert f"[{done} of {len(COVERAGE)} entries of the language]" in text("README.md")


def test_the_licence_is_apache_2() -> None:
    assert "Apache License" in text("LICENSE")
    assert tomllib.loads(text("pyproject.toml"))["project"]["license"] == "Apache-2.0"


def test_the_packages_are_typed() -> None:
    assert [package for package in PACKAGES if not (package / "py.typed").exists()] == []


def test_both_packages_have_the_version_that_the_project_is_built_with() -> None:
    assert (dmc41x3.__version__, maya_un.__version__) == (version("maya-un"), version("maya-un"))
