"""The header of a recording gives its origin, and no more."""

from __future__ import annotations

import json
from dataclasses import replace

import pytest

from maya_un.config import Config
from maya_un.config.files import parse
from maya_un.recorder.recording import Header, RecordingOrigin, Software, date, plain
from tests.unit.recorder.recordings import UTC, header


def test_a_header_is_read_back_as_it_was_written() -> None:
    assert Header.from_json(header().to_json()) == header()


def test_a_replay_finds_the_machine_in_it() -> None:
    config = parse({"geometry": {"height": 2.4}, "axes": {"b": {"maximum": 2.2}}})
    found = replace(header(), origin=RecordingOrigin.of(config, "sim"))
    assert parse(Header.from_json(found.to_json()).origin.config) == config


def test_only_sections_of_the_machine_go_into_it() -> None:
    sections = set(RecordingOrigin.of(Config(), "sim").config)
    assert sections == set(Config().model_dump()) - {"camera", "coms", "recorder", "storage"}


def test_it_names_the_software_and_not_the_host() -> None:
    found = Software.running()
    assert found.python.startswith("3.")
    assert found.processors >= 1
    assert set(json.loads(header().to_json())["software"]) == {"maya_un", "python", "system", "machine", "processors"}


@pytest.mark.parametrize("change", [{"format": "diary"}, {"version": 2}, {"saved": "late"}])
def test_invalid_header_is_refused(change: dict[str, object]) -> None:
    text = json.dumps(json.loads(header().to_json()) | change)
    with pytest.raises(ValueError, match=r"it is no maya-recording of version 1|its header is not valid"):
        Header.from_json(text)


def test_dates_are_counted_back_from_the_instant_of_saving() -> None:
    assert date(UTC) == "2026-11-21T19:25:20.339Z"
    assert header().date == "2026-11-21T19:25:20.339Z"
    assert header().utc_at(90.5) == UTC - 9_500_000_000
    fast = replace(header(), origin=replace(header().origin, speed=50.0))
    assert fast.utc_at(90.0) == UTC - 200_000_000


def test_details_of_events_become_json() -> None:
    assert plain({"axis": 1, "far": 0.5, "yes": True, "no": None, "name": "b", "all": (1, 2)}) == {
        "axis": 1,
        "far": 0.5,
        "yes": True,
        "no": None,
        "name": "b",
        "all": "(1, 2)",
    }
