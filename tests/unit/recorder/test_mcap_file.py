"""MCAP files are read back unchanged, by us and by the library alone."""

from __future__ import annotations

import io
import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import hypothesis.strategies as st
import jsonschema
import pytest
from hypothesis import given
from mcap.reader import make_reader

from dmc41x3.wire.transcript import WirePiece
from maya_un.errors import FileUnreadable
from maya_un.recorder import mcap_file
from maya_un.recorder.recording import Recording
from tests.unit.recorder.recordings import RECORDING, UTC, header

sides = st.sampled_from(("client", "controller"))
times = st.floats(0.0, 1e6)
pieces = st.tuples(times, st.integers(-3, 5), sides, st.binary(max_size=300)).map(lambda fields: WirePiece(*fields))
events = st.tuples(times, st.integers(1, 5), sides, st.just(b""), st.sampled_from(("open", "end"))).map(
    lambda fields: WirePiece(*fields)
)


def written(recording: Recording) -> bytes:
    file = io.BytesIO()
    mcap_file.write(recording, file)
    return file.getvalue()


def messages(data: bytes, topic: str) -> list[tuple[int, Any]]:
    """Return what the library alone finds on a topic: times and decoded JSON."""
    found = make_reader(io.BytesIO(data), validate_crcs=True).iter_messages([topic])
    return [(message.log_time, json.loads(message.data)) for _, _, message in found]


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("recordings") / "one.mcap"
    path.write_bytes(written(RECORDING))
    return path


def test_a_recording_is_read_back_as_it_was(file: Path) -> None:
    assert mcap_file.read(file) == RECORDING
    assert mcap_file.read_header(file) == RECORDING.header


@given(st.lists(pieces | events, max_size=20))
def test_any_bytes_on_the_wire_are_read_back_in_order(wire: list[WirePiece]) -> None:
    wire.sort(key=lambda piece: piece.time)
    recording = replace(RECORDING, wire=tuple(wire))
    assert mcap_file.read_from(io.BytesIO(written(recording))) == recording


def test_every_message_is_as_its_schema_says(file: Path) -> None:
    reader = make_reader(io.BytesIO(file.read_bytes()))
    seen: set[str] = set()
    for schema, channel, message in reader.iter_messages():
        assert schema is not None
        assert (schema.encoding, channel.message_encoding) == ("jsonschema", "json")
        jsonschema.validate(json.loads(message.data), json.loads(schema.data))
        seen.add(channel.topic)
    assert seen == {topic.name for topic in mcap_file.TOPICS}


def test_the_schema_of_a_state_names_every_field_of_it(file: Path) -> None:
    fields = messages(file.read_bytes(), "/state")[0][1]
    assert set(fields) == set(mcap_file.STATE.schema["properties"])


def test_times_are_dates_and_the_file_is_indexed(file: Path) -> None:
    reader = make_reader(io.BytesIO(file.read_bytes()))
    summary = reader.get_summary()
    assert summary is not None
    assert summary.statistics is not None
    assert summary.statistics.message_start_time == UTC - 10_000_000_000
    assert summary.statistics.message_end_time == UTC
    assert summary.chunk_indexes
    assert {channel.topic for channel in summary.channels.values()} == {topic.name for topic in mcap_file.TOPICS}
    late = list(reader.iter_messages(["/wire"], starting_at=UTC - 1_500_000_000))
    assert [json.loads(message.data)["t"] for _, _, message in late] == [99.0, 99.9, 100.0]


def test_joints_are_foxglove_s_once_homed(file: Path) -> None:
    first, second = messages(file.read_bytes(), "/joint_states")
    assert first[0] == UTC - 4_900_000_000
    assert first[1] == {
        "timestamp": {"sec": 1_795_289_115, "nsec": 439_000_000},
        "joints": [
            {"name": "a", "position": 0.3, "velocity": 0.0},
            {"name": "b", "position": 1.5, "velocity": -0.045},
            {"name": "c", "position": 1.3, "velocity": 0.01},
        ],
    }
    assert second[0] == UTC - 100_000_000


def test_commands_are_paired_with_their_answers(file: Path) -> None:
    found = [content for _, content in messages(file.read_bytes(), "/exchanges")]
    assert [(one["command"], one["ok"], one["reply"]) for one in found] == [
        ("MG TIME", True, " 5.0000"),
        ("BGA", False, ""),
        ("TP", None, ""),
    ]
    assert found[1]["took"] == pytest.approx(0.002)
    assert found[2]["took"] is None


def test_it_is_compressed(file: Path) -> None:
    many = replace(RECORDING, states=RECORDING.states * 500)
    plain = sum(len(json.dumps(content)) for _, content in messages(written(many), "/state"))
    assert len(written(many)) < plain / 5


def test_a_damaged_file_is_refused_as_one_or_read_and_breaks_nothing(tmp_path: Path) -> None:
    whole = written(RECORDING)
    path = tmp_path / "damaged.mcap"
    for end in range(0, len(whole), 97):
        path.write_bytes(whole[:end])
        with pytest.raises(FileUnreadable):
            mcap_file.read(path)
    for place in range(8, len(whole), 61):
        path.write_bytes(whole[:place] + bytes([whole[place] ^ 0xFF]) + whole[place + 1 :])
        try:
            mcap_file.read(path)
        except FileUnreadable:
            continue


def test_other_mcap_and_missing_file_are_no_recordings(tmp_path: Path) -> None:
    from mcap.writer import Writer

    path = tmp_path / "other.mcap"
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start()
        writer.finish()
    with pytest.raises(FileUnreadable, match="it holds no maya-recording"):
        mcap_file.read(path)
    with pytest.raises(FileUnreadable, match="No such file"):
        mcap_file.read(tmp_path / "none.mcap")


def test_an_empty_recording_is_one_too(tmp_path: Path) -> None:
    path = tmp_path / "empty.mcap"
    path.write_bytes(written(Recording(header())))
    assert mcap_file.read(path) == Recording(header())
    assert Recording(header()).span == (100.0, 100.0)
