"""`maya zones`, with a service that stores its requests."""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Any

import pytest

from maya_un import runtime
from maya_un.cli.main import main
from maya_un.config.model import parse_zone
from maya_un.runtime import Running
from tests.unit.cli.servers import http_service

ADDED = "maya zones add rack box low=0.1,1,0 high=0.3,1500mm,60cm margin=20mm lines=false"


class Kept:
    """The zones of the service, by name."""

    def __init__(self) -> None:
        self.zones: dict[str, Any] = {}

    def says(self, method: str, path: str, body: Any) -> tuple[int, object]:
        name = path.removeprefix("/v1/zones").removeprefix("/")
        match method:
            case "PUT":
                self.zones[name] = parse_zone({**body, "name": name}).model_dump(mode="json")
                return 200, self.zones[name]
            case "DELETE":
                del self.zones[name]
                return 200, {"removed": name}
            case _:
                return 200, list(self.zones.values())


@pytest.fixture
def kept(monkeypatch: pytest.MonkeyPatch) -> Iterator[Kept]:
    found = Kept()
    with http_service(found.says) as url:
        monkeypatch.setattr(runtime, "find", lambda: Running(url, 1, None))
        monkeypatch.setattr(runtime, "claimant", lambda: 1)
        yield found


def printed(line: str, capsys: pytest.CaptureFixture[str], code: int = 0) -> str:
    assert main(line.split()[1:]) == code
    out, err = capsys.readouterr()
    return out + err


def test_zone_is_added_with_units_for_this_run_only(kept: Kept, capsys: pytest.CaptureFixture[str]) -> None:
    assert printed(ADDED, capsys).startswith("Added zone rack: the robot keeps out of it. This change lasts until")
    rack = kept.zones["rack"]
    assert (rack["low"], rack["high"]) == ([0.1, 1.0, 0.0], pytest.approx([0.3, 1.5, 0.6]))
    assert (rack["margin"], rack["lines"]) == (pytest.approx(0.02), False)


def test_listed_zone_can_be_typed_back(kept: Kept, capsys: pytest.CaptureFixture[str]) -> None:
    printed(ADDED, capsys)
    printed("maya zones add post cylinder x=-0.1 y=1 radius=5cm low=0 high=1", capsys)
    printed("maya zones add wall half_space point=0,2,0 normal=0,-1,0", capsys)
    before = dict(kept.zones)
    rows = printed("maya zones", capsys).splitlines()[1:-1]
    assert len(rows) == 3
    for row in rows:
        printed(f"maya zones add {row}", capsys)
    assert kept.zones == before


def test_missing_zones_are_reported(kept: Kept, capsys: pytest.CaptureFixture[str]) -> None:
    assert printed("maya zones list", capsys).startswith("There are no zones.\n")
    assert json.loads(printed("maya zones list --json", capsys))["zones"] == []


def test_a_zone_is_removed(kept: Kept, capsys: pytest.CaptureFixture[str]) -> None:
    printed(ADDED, capsys)
    assert json.loads(printed("maya zones remove rack --json", capsys))["removed"] == "rack"
    assert kept.zones == {}


@pytest.mark.parametrize(
    ("rest", "code"),
    [
        ("rack box low", 4008),
        ("rack box low=", 4008),
        ("rack box x=1 x=2", 4008),
        ("rack ball x=1", 4008),
        ("rack box lines=yes", 4001),
        ("rack box margin=2kg", 4001),
        ("rack box low=1,,2", 4001),
    ],
)
def test_invalid_zone_is_refused(rest: str, code: int, kept: Kept, capsys: pytest.CaptureFixture[str]) -> None:
    assert f"error {code}" in printed(f"maya zones add {rest}", capsys, code=2)
    assert kept.zones == {}


def test_without_a_running_robot_there_is_nothing_to_ask(capsys: pytest.CaptureFixture[str]) -> None:
    assert "error 1020" in printed("maya zones", capsys, code=1)
