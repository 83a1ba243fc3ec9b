"""One declaration is all that an event needs: this one is declared here, and every reader knows it."""

from __future__ import annotations

import asyncio
import io
import json
import logging
import runpy
import sys
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import pytest

from dmc41x3.loops import run
from maya_ros.graph.events import read
from maya_un.cli.main import main
from maya_un.cli.progress import line
from maya_un.events import DECLARED, ControllerEvent, Event, UnknownEvent
from maya_un.http.log import level_of
from maya_un.process.journal.protocol import EventRow
from maya_un.process.journal.sqlite import SqliteJournal
from maya_un.recorder import mcap_file
from tests.conventions.source import ROOT
from tests.graphs import layer_nodes
from tests.streaming import Watched, connected, streamed
from tests.unit.http.service_stand_in import ServiceStandIn, app_client
from tests.unit.recorder.recordings import RECORDING
from tests.virtual_time import turn


@dataclass(frozen=True)
class LampLit(
    ControllerEvent,
    word="lamp",
    en="lamp {lamp} at {power:.1f} W",
    narrated=True,
    level=logging.WARNING,
):
    """A lamp is lit: `lamp` is its name, `power` what it takes [W]. `until` is when it goes out; None for never."""

    lamp: str
    power: float
    until: str | None = None


del DECLARED["lamp"]  # other tests know only the events of the program
LIT = LampLit("door", 2.5, code=2308)
DETAIL: dict[str, object] = {"lamp": "door", "power": 2.5}


@pytest.fixture(autouse=True)
def declared(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(DECLARED, "lamp", LampLit)


@pytest.fixture(scope="module")
def pages() -> dict[str, Any]:
    """The functions of the program that writes generated pages."""
    sys.path.insert(0, str(ROOT / "scripts"))
    try:
        return runpy.run_path(str(ROOT / "scripts" / "gen_docs.py"))
    finally:
        sys.path.remove(str(ROOT / "scripts"))


def test_the_command_line_narrates_it_in_both_languages() -> None:
    assert line(LIT, "en") == "       lamp door at 2.5 W (2308)"
    assert line(LIT, "es") == "       lamp door at 2.5 W (2308)"


def test_maya_logs_shows_it_from_the_journal_in_both_languages(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("MAYA_STATE_DIR", str(tmp_path))
    detail = {**DETAIL, "until": "noon"}

    async def keep() -> None:
        journal = await SqliteJournal.open(tmp_path / "maya.db")
        journal.note(EventRow(1, 1, "2026-11-21T10:00:00+00:00", 0.0, "lamp", 2308, detail))
        await journal.close()

    asyncio.run(keep())
    assert main(["logs", "--kind", "lamp"]) == main(["--lang", "es", "logs"]) == main(["logs", "--json"]) == 0
    english, spanish, data = capsys.readouterr().out.splitlines()
    assert english.endswith("warning  lamp            lamp door at 2.5 W  until=noon (2308)")
    assert spanish.endswith("warning  lamp            lamp door at 2.5 W  until=noon (2308)")
    assert json.loads(data)["detail"] == detail


async def test_http_answers_it_as_json() -> None:
    service = ServiceStandIn()
    service.log.emit(LIT)
    async with app_client(service) as client:
        answer = (await client.get("/v1/events")).json()
    assert answer == [{"seq": 1, "time": 0.0, "kind": "lamp", "code": 2308, "detail": DETAIL}]


def test_the_stream_sends_it_as_json() -> None:
    async def main() -> dict[str, Any]:
        watched = Watched(1, 1.0)
        async with streamed(watched) as url, connected(url) as client:
            await client.ask("subscribe", events={"since": 0})
            watched.happen(event=LIT)
            return (await client.until("event"))["event"]

    told = run(main())
    assert (told["seq"], told["kind"], told["code"], told["detail"]) == (1, "lamp", 2308, DETAIL)


async def test_graph_publishes_it_by_its_word_and_a_client_reads_it() -> None:
    async with layer_nodes(homed=False) as layers:
        texts, heard = list[str](), list[Event]()
        somebody = layers.bus.node("somebody")
        somebody.subscribe("/maya_event", "std_msgs/String", lambda message: texts.append(message["data"]))
        layers.controller.events.heard_by(heard.append)
        layers.controller_node.rig.controller.events.emit(LIT)
        while not (heard and texts[-1].startswith("lamp")):
            await turn()
    told = read(texts[-1])
    assert (texts[-1].split(" ")[0], told.code, told.detail) == ("lamp", 2308, DETAIL)
    assert replace(heard[-1], seq=0, time=0.0) == LIT


def test_the_log_has_its_level() -> None:
    assert (level_of("lamp"), level_of("dance")) == (logging.WARNING, logging.INFO)


def test_a_recording_holds_it_and_a_program_that_does_not_know_it_shows_it(monkeypatch: pytest.MonkeyPatch) -> None:
    file = io.BytesIO()
    mcap_file.write(replace(RECORDING, events=(replace(LIT, seq=9, time=95.0),)), file)
    file.seek(0)
    assert mcap_file.read_from(file).events == (replace(LIT, seq=9, time=95.0),)
    monkeypatch.delitem(DECLARED, "lamp")
    file.seek(0)
    (unknown,) = mcap_file.read_from(file).events
    assert unknown == UnknownEvent("lamp", seq=9, time=95.0, code=2308, more=DETAIL)
    assert (unknown.kind, unknown.detail, unknown.report("es")) == ("lamp", DETAIL, "lamp lamp=door power=2.5")


def test_the_generated_files_have_it(pages: dict[str, Any]) -> None:
    row = next(line for line in pages["events_page"]().splitlines() if line.startswith("| `lamp` |"))
    assert row == (
        "| `lamp` | A lamp is lit: `lamp` is its name, `power` what it takes [W]. `until` is when it goes out; None "
        "for never. | `lamp` text, `power` number, `until`? text | yes | yes | warning | "
        "lamp {lamp} at {power:.1f} W | lamp {lamp} at {power:.1f} W |"
    )
    assert json.loads(pages["dashboard_events"]())["lamp"] == [LampLit.en, LampLit.en]
    assert 'LAMP = EventWord("lamp")\n' in pages["words_for_ros"]()
    assert "lamp, " in next(line for line in pages["PAGES"]["reference/graph.md"]().splitlines() if "refused." in line)
