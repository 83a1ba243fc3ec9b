"""The declaration of the original stack: every new name in it exists, and the documentation holds its table."""

from __future__ import annotations

import ast
import re
from operator import attrgetter
from pathlib import Path
from string import Formatter
from xml.etree import ElementTree as Xml

import pytest

from maya_ros.graph.table import TABLE
from maya_ros.migration import finding, original
from maya_ros.migration.original import LAUNCH, MODULES, NODE_PYTHON, PROGRAMS, RENAMED, RULES, Rule
from maya_un.cli import app
from maya_un.config import Config, template
from maya_un.errors import by_code

ROOT = Path(__file__).resolve().parents[4]
ROS = ROOT / "ros"


def rule_texts() -> str:
    return "\n".join(f"{rule.why} {rule.instead}" for rule in RULES)


def test_launch_files_have_the_declared_arguments() -> None:
    found = {
        f"{path.parents[1].name}/{path.name}": {arg.attrib["name"] for arg in Xml.parse(path).getroot().findall("arg")}
        for path in ROS.glob("*/launch/*.launch")
    }
    assert found == LAUNCH


@pytest.mark.parametrize("package", PROGRAMS)
def test_programs_are_those_that_cmake_installs(package: str) -> None:
    text = (ROS / package / "CMakeLists.txt").read_text(encoding="utf-8").replace("${PROJECT_NAME}", package)
    installed = {word.rpartition("/")[2] for word in re.findall(r"[\w/.]+\.(?:py|sh)\b", text)} - {"nodes_python.py"}
    assert installed == PROGRAMS[package]


@pytest.mark.parametrize("module", MODULES)
def test_a_module_has_the_declared_functions(module: str) -> None:
    path = ROS / module.partition(".")[0] / "src" / module.replace(".", "/")
    if path.is_dir():
        assert all((path / f"{name}.py").is_file() for name in MODULES[module])
        return
    text = path.with_suffix(".py").read_text(encoding="utf-8")
    body = ast.parse(text).body
    functions = {node.name for node in body if isinstance(node, ast.FunctionDef)}
    functions |= {
        name.asname for node in body if isinstance(node, ast.ImportFrom) for name in node.names if name.asname
    }
    assert functions == MODULES[module]
    assert ("from maya_un" in text or "from maya_ros" in text) == (module in NODE_PYTHON)


def test_a_new_name_is_in_the_graph() -> None:
    names = {row.name for row in TABLE}
    assert set(RENAMED.values()) <= names
    assert not set(RENAMED) & names
    assert original.EVENT_TOPIC in names


def test_constants_have_the_keys_of_the_configuration() -> None:
    assert all(attrgetter(key)(Config()) is not None for key in finding.constants().values())


def test_advice_names_commands_that_exist() -> None:
    groups = {"dmc": app.dmc_tools, "config": app.config}
    known = {one.name or one.callback.__name__ for one in app.app.registered_commands if one.callback}
    known |= {group.name for group in app.app.registered_groups if group.name}
    for words in re.findall(r"`maya ([a-z ]+)", rule_texts()):
        first, *rest = words.split()
        assert first in known | {"stop"}, words
        if first in groups and rest:
            below = {one.name or one.callback.__name__ for one in groups[first].registered_commands if one.callback}
            below |= {group.name for group in groups[first].registered_groups if group.name}
            assert rest[0] in below, words


def test_advice_names_codes_topics_and_keys_that_exist() -> None:
    text = rule_texts()
    assert {int(code) for code in re.findall(r"\b[1-5][0-9]{3}\b", text)} - {9090} <= set(by_code())
    names = {*(row.name for row in TABLE), "/usr", "/maya_events"}
    assert set(re.findall(r"(?<![\w/.<{)~])/[a-z_]+\b(?!/)", text)) <= names
    for section, key in re.findall(r"`(gripper|wiring)\.(\w+)`", text):
        assert re.search(rf"^\[{section}\](?:\n[^\[]*)*\n#? ?{key} =", template(), re.MULTILINE), key


@pytest.mark.parametrize("rule", RULES, ids=lambda rule: rule.key)
def test_an_example_fills_in_every_detail_of_its_rule(rule: Rule) -> None:
    used = {name for text in (rule.why, rule.instead) for _, name, _, _ in Formatter().parse(text) if name}
    assert used == rule.example.keys()


def test_keys_of_rules_are_different() -> None:
    assert len({rule.key for rule in RULES}) == len(RULES)
