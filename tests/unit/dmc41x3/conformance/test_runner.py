"""The runner sees every way in which a controller can be wrong, and puts back what it changed."""

from __future__ import annotations

import pytest

from dmc41x3.conformance import Demand, Vector, run
from dmc41x3.conformance.runner import UNASKED, coalesced
from dmc41x3.conformance.vectors import Special, VectorStep
from tests.channels import Bench


class Box:
    """A controller with scripted answers: one for each command, in pieces."""

    def __init__(self, **answers: bytes | list[bytes]) -> None:
        self.answers = {'MG "fence"': b"fence\r\n:", "TC": b" 0\r\n:"} | answers
        self.sent: list[str] = []
        self.waited = 0.0
        self._inbox: list[bytes] = []
        self._closed = False

    def dial(self) -> Box:
        return self

    def send(self, data: bytes) -> None:
        text = data.decode("latin-1").rstrip("\r")
        self.sent.append(text)
        answer = self.answers.get(text, b":")
        self._inbox += answer if isinstance(answer, list) else [answer]

    def receive(self) -> bytes:
        return self._inbox.pop(0) if self._inbox else b""

    def wait(self, seconds: float) -> None:
        self.waited += seconds

    def ended(self) -> bool:
        return self._closed

    def close(self) -> None:
        self._closed = True


def vector(*steps: VectorStep, **more: object) -> Vector:
    return Vector(name="it", steps=steps, sources="G", certainty="one", **more)  # pyright: ignore[reportArgumentType]


@pytest.mark.parametrize(
    "answer",
    [b"", b"?", b" 2\r\n:", b" 1\r\n", b" 1\r\n::", b"NO\r\n 1\r\n:", b"1\r\n:", b" 1\r\n\r\n:"],
    ids=["silence", "refusal", "another value", "no prompt", "two prompts", "echo", "no blank", "an empty line"],
)
def test_a_wrong_answer_is_a_difference(answer: bytes) -> None:
    difference = run(vector(VectorStep("NO\r", (" 1\r\n:",))), Box(NO=answer).dial, 3)
    assert difference is not None


@pytest.mark.parametrize("pieces", [[b" 1\r\n:"], [b" ", b"1\r", b"\n", b":"]])
def test_right_answer_has_no_difference_in_any_pieces(pieces: list[bytes]) -> None:
    assert run(vector(VectorStep("NO\r", (" 2\r\n:", "<n>\r\n:"))), Box(NO=pieces).dial, 3) is None


def test_first_difference_is_shown_with_the_reply() -> None:
    difference = run(vector(VectorStep("A\r", (":",)), VectorStep("B\r", ("?", "x"))), Box(B=b" 7\r\n:").dial, 3)
    assert difference is not None
    assert (difference.sent, difference.expected, difference.received) == ("B\r", ("?", "x"), b" 7\r\n:")
    assert str(difference) == "it: sent 'B\\r', expected '?' or 'x', received b' 7\\r\\n:'"


def test_a_message_is_waited_for_and_missed_in_the_end() -> None:
    box = Box()
    assert run(vector(VectorStep(expect=("hi\r\n",))), box.dial, 3) is not None
    assert box.waited == pytest.approx(UNASKED)


def test_answer_is_polled_until_it_arrives_or_times_out() -> None:
    never = VectorStep("BG?\r", (" 0\r\n:",), special=Special.UNTIL, seconds=1.0)
    box = Box(**{"BG?": b" 1\r\n:"})
    assert run(vector(never), box.dial, 3) is not None
    assert box.waited == pytest.approx(1.0)
    assert run(vector(never), Box(**{"BG?": b" 0\r\n:"}).dial, 3) is None


def test_open_connection_is_a_difference_if_an_end_is_expected() -> None:
    difference = run(vector(VectorStep(on="second", special=Special.CLOSED)), Bench(3).dial, 3)
    assert difference is not None
    assert difference.expected == ("the end of the connection",)


@pytest.mark.parametrize(
    "answer", [b"?", b"\x87\x07\xbe\x00" + bytes(186) + b"\r\n:", b"\x87\x07\xbd\x00" + bytes(185) + b":"]
)
def test_a_wrong_record_is_a_difference(answer: bytes) -> None:
    assert run(vector(VectorStep("QR\r", special=Special.RECORD)), Box(QR=answer).dial, 3) is not None


def test_fields_of_a_record_are_checked_by_their_mask() -> None:
    record = b"\x87\x07\xbe\x00" + bytes(46) + b"\x05" + bytes(139) + b":"
    assert len(record) == 191
    for low, mask, right in ((5, 0, True), (6, 0, False), (1, 1, True), (4, 4, True), (2, 2, False)):
        step = VectorStep("QR\r", special=Special.RECORD, fields=((50, "B", low, low, mask),))
        assert (run(vector(step), Box(QR=record).dial, 3) is None) is right


def test_registers_are_restored_after_any_end() -> None:
    box = Box(**{"MG _SPA": b" 25000.0000\r\n:", "SPA=1": b"?"})
    assert run(vector(VectorStep("SPA=1\r", (":",)), keep=("SPA",), restore=("CW 2",)), box.dial, 3) is not None
    assert box.sent == ["MG _SPA", "SPA=1", "CW 2", "SPA=25000.0000", "TC"]


def test_moving_axes_are_brought_to_rest() -> None:
    bench = Bench(3)
    step = VectorStep("SH;DC*=20480;JG*=5000;BG\r", ("::::",))
    assert run(vector(step, demands=frozenset({Demand.MOVES})), bench.dial, 3) is None
    assert not any(axis.moving for axis in bench.machine.unit.axes)


@pytest.mark.parametrize(("origin", "place"), [("DPA=0", 0), ("DPA=100", 600)])
def test_axis_returns_to_its_initial_position(origin: str, place: int) -> None:
    bench = Bench(3)
    rest = VectorStep("MG _BGA\r", (" 0.0000\r\n:",), special=Special.UNTIL, seconds=5.0)
    steps = (VectorStep("PRA=500;BGA\r", ("::",)), rest)
    assert run(vector(*steps, setup=("SHA", origin), demands=frozenset({Demand.MOVES})), bench.dial, 3) is None
    axis = bench.machine.unit.axes[0]
    assert axis.reference(bench.machine.now) == place


def test_consecutive_exchanges_are_joined() -> None:
    wait = VectorStep(special=Special.WAIT, seconds=1.0)
    steps = (
        VectorStep("A\r", (":", "?")),
        VectorStep("B\r", ("x",)),
        wait,
        VectorStep("C\r", (":",)),
        VectorStep("D\r", (":",), on="two"),
    )
    assert coalesced(vector(*steps)).steps == (VectorStep("A\rB\r", (":x", "?x")), wait, *steps[3:])
