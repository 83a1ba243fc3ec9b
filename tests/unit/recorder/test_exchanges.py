"""Commands find their answers, from the beginning of a conversation or from its middle."""

from __future__ import annotations

import hypothesis.strategies as st
from hypothesis import given

from dmc41x3.language.record import AxisRecord, DataRecord, encode
from dmc41x3.wire.framing import RecordReply, Reply
from dmc41x3.wire.transcript import WirePiece
from maya_un.recorder.exchanges import QUIET, talk

RECORD = encode(DataRecord(axes=(AxisRecord(position=5),) * 3))


def sent(time: float, data: bytes, link: int = 1) -> WirePiece:
    return WirePiece(time, link, "client", data)


def received(time: float, data: bytes, link: int = 1) -> WirePiece:
    return WirePiece(time, link, "controller", data)


def opened(link: int = 1) -> WirePiece:
    return WirePiece(0.0, link, "client", b"", "open")


def test_answers_belong_to_commands_in_order_however_the_bytes_are_cut() -> None:
    found = talk(
        [
            opened(),
            sent(1.0, b"TP;QR\rBG"),
            received(1.1, b" 1, 2, 3\r"),
            received(1.2, b"\n:" + RECORD[:50]),
            sent(1.3, b"A\r"),
            received(1.4, RECORD[50:] + b":?"),
        ]
    )
    assert [(one.time, one.command, one.reply, one.answered) for one in found.exchanges] == [
        (1.0, "TP", Reply(True, " 1, 2, 3"), 1.2),
        (1.0, "QR", RecordReply(RECORD), 1.4),
        (1.3, "BGA", Reply(False), 1.4),
    ]
    assert found.unpaired == []


def test_download_is_one_command_with_its_end() -> None:
    found = talk([opened(), sent(0.0, b"DL\r#A;MG 1\rEN\r\\TC1\r"), received(0.1, b":: 0\r\n:")])
    assert [one.command for one in found.exchanges] == ["DL", "\\", "TC1"]
    assert all(one.reply is not None for one in found.exchanges)


def test_messages_of_programs_have_their_time() -> None:
    message = bytes(byte | 0x80 for byte in b"MAYA limit\r\n")
    found = talk([opened(), sent(1.0, b"TP\r"), received(2.0, message[:4]), received(2.5, message[4:] + b" 1\r\n:")])
    assert found.messages == [(2.5, "MAYA limit")]
    assert found.exchanges[0].reply == Reply(True, " 1")


def test_connections_are_separate() -> None:
    found = talk(
        [
            opened(1),
            opened(2),
            sent(1.0, b"TP\r", 1),
            sent(1.1, b"TIME=?\r", 2),
            received(1.2, b" 9.0\r\n:", 2),
            received(1.3, b" 1\r\n:", 1),
        ]
    )
    assert [(one.link, one.command, one.reply) for one in found.exchanges] == [
        (1, "TP", Reply(True, " 1")),
        (2, "TIME=?", Reply(True, " 9.0")),
    ]


def test_pairing_in_the_middle_begins_without_outstanding_commands() -> None:
    found = talk(
        [
            received(0.99, b"1, 2, 3\r\n:"),
            sent(1.0, b"MG 1\r"),
            received(1.001, b":"),  # of a command before the recording
            received(1.002, b" 1.0000\r\n:"),
            sent(1.1, b"QR\r"),
            received(1.1, RECORD + b":"),
        ]
    )
    assert [(one.command, one.reply) for one in found.exchanges] == [("QR", RecordReply(RECORD))]
    assert found.unpaired == []


def test_unmatched_bytes_are_reported_and_pairing_goes_on_after_them() -> None:
    """The command SHA is missing from the recording: its prompt takes the place of the record's."""
    found = talk(
        [
            opened(),
            sent(0.0, b"TP\r"),
            received(0.0, b" 1\r\n:"),
            received(0.5, b":"),
            sent(1.0, b"TP\r"),
            received(1.0, b" 2\r\n:"),
        ]
    )
    assert [(one.time, one.data) for one in found.unpaired] == [(0.5, b":")]
    assert [(one.time, one.reply) for one in found.exchanges] == [(0.0, Reply(True, " 1")), (1.0, Reply(True, " 2"))]


commands = st.lists(st.sampled_from(("TP", "QR", "MG 5", "SHA", "XX")), min_size=1, max_size=12)
ANSWERS = {"TP": b" 1, 2\r\n:", "QR": RECORD + b":", "MG 5": b" 5.0000\r\n:", "SHA": b":", "XX": b"?"}


@given(commands, st.data())
def test_wherever_a_quiet_conversation_is_cut_the_rest_is_paired_rightly(
    commands: list[str], data: st.DataObject
) -> None:
    pieces = [opened()]
    for number, command in enumerate(commands):
        pieces.append(sent(number * 2 * QUIET, f"{command}\r".encode()))
        pieces.append(received(number * 2 * QUIET + 0.001, ANSWERS[command]))
    cut = data.draw(st.integers(1, len(pieces) - 1))
    found = talk(pieces[cut:])
    whole = {one.time: one for one in talk(pieces).exchanges}
    assert all(one == whole[one.time] for one in found.exchanges)
    assert len(found.exchanges) == len([piece for piece in pieces[cut:] if piece.side == "client" and piece.data])
    assert found.unpaired == []
