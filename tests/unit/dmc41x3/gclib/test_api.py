"""The class `py` on a twin, by real sockets."""

from __future__ import annotations

import socket
import threading
from collections.abc import Iterator
from pathlib import Path

import pytest

from dmc41x3.gclib.errors import Code, GclibError
from dmc41x3.gclib.shim import gclib
from dmc41x3.twin.network import HandleProtocol
from tests.served_twin import ServedTwin, served

PROGRAM = '#A\nMG "one"\nMG "two",3\nEN\n'


@pytest.fixture
def twin() -> Iterator[ServedTwin]:
    with served() as found:
        yield found


@pytest.fixture
def g(twin: ServedTwin) -> Iterator[gclib.py]:
    opened = gclib.py()
    opened.GOpen(f"{twin.address} --direct -s ALL -t 3000")
    yield opened
    opened.GClose()


def code_of(error: pytest.ExceptionInfo[GclibError]) -> Code | None:
    return error.value.code


def test_a_command_is_answered_without_blanks(g: gclib.py) -> None:
    assert g.GCommand("MG 5") == "5.0000"
    assert g.GCommand("SHA") == ""
    assert g.GCommand("TP\r") == "0, 0, 0"
    assert g.GCommand("") == ""
    assert g.GCommand("MG 1;SHA;MG 2;") == "1.0000\r\n2.0000"


def test_threads_on_one_connection_get_their_own_answers(g: gclib.py) -> None:
    wrong: list[str] = []

    def ask(first: int) -> None:
        for number in range(first, first + 100):
            try:
                answer = g.GCommand(f"MG {number}")
            except GclibError as error:
                answer = str(error)
            if answer != f"{number}.0000":
                wrong.append(f"{number}: {answer}")

    threads = [threading.Thread(target=ask, args=(1000 * place,)) for place in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert wrong == []


def test_refused_command_leaves_its_code_readable(g: gclib.py) -> None:
    with pytest.raises(GclibError, match=r"^question mark returned by controller$") as caught:
        g.GCommand("BGA;spoilt=1")
    assert code_of(caught) == -10000
    assert g.GCommand("TC1").startswith("20 ")
    with pytest.raises(GclibError):
        g.GCommand("MG spoilt")


@pytest.mark.parametrize("command", ["DL", "QD a[]", "ED", "QR", "TP;DL"])
def test_commands_with_a_method_of_their_own_are_illegal(g: gclib.py, command: str) -> None:
    with pytest.raises(GclibError, match="illegal command passed to command call"):
        g.GCommand(command)


def test_listings_are_available_by_their_command(g: gclib.py) -> None:
    g.GProgramDownload(PROGRAM)
    assert g.GCommand("UL").splitlines() == PROGRAM.splitlines()


def test_information(twin: ServedTwin, g: gclib.py) -> None:
    assert g.GInfo() == "127.0.0.1, DMC4133 Rev 1.3k, 41330, IHA IHB"
    assert g.GVersion().startswith("py.")
    assert g.GAddresses() == {"127.0.0.1": "DMC4133 Rev 1.3k"}
    assert gclib.py().GAddresses() == {}
    assert g.GIpRequests() == {}


def test_unsupported_function_is_reported(g: gclib.py) -> None:
    for work, code in (
        (lambda: g.GAssign("10.0.0.1", "00:50:4c:00:00:01"), Code.UNSUPPORTED_FUNCTION),
        (lambda: g.GFirmwareDownload("f.hex"), Code.FIRMWARE_LOAD_NOT_SUPPORTED),
        (lambda: g.GSetupDownloadFile("f.gcb", 0), Code.UNSUPPORTED_FUNCTION),
    ):
        with pytest.raises(GclibError) as caught:
            work()
        assert code_of(caught) is code


def test_nothing_works_without_a_connection() -> None:
    g = gclib.py()
    for work in (lambda: g.GCommand("TP"), g.GInfo, g.GMessage, lambda: g.GTimeout(5), g.GProgramUpload):
        with pytest.raises(GclibError) as caught:
            work()
        assert code_of(caught) is Code.CONNECTION_NOT_ESTABLISHED
    g.GClose()


def test_missing_controller_is_reported() -> None:
    with socket.create_server(("127.0.0.1", 0)) as listener:
        port = listener.getsockname()[1]
    with pytest.raises(GclibError, match="device failed to open"):
        gclib.py().GOpen(f"127.0.0.1:{port}")


def test_programs_are_downloaded_and_uploaded(g: gclib.py, tmp_path: Path) -> None:
    g.GProgramDownload(f"REM for people\n{PROGRAM}", "--max 4")
    assert g.GProgramUpload() == PROGRAM.replace("\n", "\r\n")
    g.GProgramUploadFile(str(tmp_path / "a.dmc"))
    g.GProgramDownload("")
    assert g.GProgramUpload() == ""
    g.GProgramDownloadFile(str(tmp_path / "a.dmc"))
    assert g.GProgramUpload() == PROGRAM.replace("\n", "\r\n")


@pytest.mark.parametrize(
    ("program", "preprocessor", "code"),
    [
        ("a\\b", "", Code.ILLEGAL_DATA_IN_PROGRAM),
        ("x" * 81, "", Code.UNABLE_TO_COMPRESS),
        ("EN", "--shrink", Code.INVALID_PREPROCESSOR_OPTIONS),
        ("#A\nEN\n#A\nEN", "", Code.QUESTION_MARK),
    ],
)
def test_a_program_that_cannot_be_loaded(g: gclib.py, program: str, preprocessor: str, code: Code) -> None:
    with pytest.raises(GclibError) as caught:
        g.GProgramDownload(program, preprocessor)
    assert code_of(caught) is code
    assert g.GCommand("MG 1") == "1.0000"


def test_a_program_is_not_replaced_while_one_runs(g: gclib.py) -> None:
    g.GProgramDownload("#A\nJP#A\n")
    g.GCommand("XQ#A")
    with pytest.raises(GclibError, match="question mark") as caught:
        g.GProgramDownload("spoilt=1\n")
    assert caught.value.detail.startswith("17 ")
    with pytest.raises(GclibError):
        g.GCommand("MG spoilt")
    g.GCommand("HX")


def test_messages_of_a_program(g: gclib.py) -> None:
    g.GProgramDownload(PROGRAM)
    g.GCommand("XQ#A")
    said = ""
    while said.count("\n") < 2:
        said += g.GMessage()
    assert said == "one\r\ntwo 3.0000\r\n"


@pytest.mark.parametrize("way", ["-u TCP", ""])
def test_messages_use_the_first_socket_without_a_second(way: str) -> None:
    with served(udp=False) as twin:
        g = gclib.py()
        g.GOpen(f"{twin.address} -s ALL {way}")
        g.GProgramDownload(PROGRAM)
        g.GCommand("XQ#A")
        assert g.GMessage().startswith("one\r\n")
        for work in (lambda: g.GRecord("DR"), lambda: g.GRecordRate(20), g.GInterrupt):
            with pytest.raises(GclibError):
                work()
        assert g.GRecord("QR").axis_a_motor_position == 0
        g.GClose()


def test_waits_end(g: gclib.py) -> None:
    g.GTimeout(30)
    assert g.timeout == 30
    for work in (g.GMessage, g.GInterrupt, lambda: g.GRecord("DR")):
        with pytest.raises(GclibError, match="device timed out"):
            work()
    g.timeout = 0
    with pytest.raises(GclibError, match="data was not waiting for a zero-timeout read"):
        g.GMessage()
    assert g.GCommand("MG 1") == "1.0000"
    with pytest.raises(GclibError):
        g.GTimeout(-2)


def test_unsubscribed_data_is_refused(twin: ServedTwin) -> None:
    g = gclib.py()
    g.GOpen(twin.address)
    for work in (g.GMessage, g.GInterrupt, lambda: g.GRecord("DR"), lambda: g.GRecordRate(20)):
        with pytest.raises(GclibError, match="function not supported"):
            work()
    assert twin.look(lambda machine: machine.unit.outlet.port) == "S"
    g.GClose()


def test_records_polled_and_pushed(twin: ServedTwin, g: gclib.py) -> None:
    g.GCommand("DPA=1234")
    for method in ("QR", gclib.G_QR):
        assert g.GRecord(method).axis_a_motor_position == 1234
    g.GRecordRate(10)
    assert twin.look(lambda machine: machine.unit.records.period) == 10
    first, second = g.GRecord("DR"), g.GRecord(gclib.G_DR)
    assert first.axis_a_motor_position == 1234
    assert (second.sample_number - first.sample_number) % 10 == 0
    g.GRecordRate(0)
    assert twin.look(lambda machine: machine.unit.records.period) == 0
    with pytest.raises(GclibError, match="out of range"):
        g.GRecord("XR")


def test_rate_is_kept_within_the_range_of_the_controller(twin: ServedTwin, g: gclib.py) -> None:
    g.GRecordRate(1)
    assert twin.look(lambda machine: machine.unit.records.period) == 8
    g.GRecordRate(1e6)
    assert twin.look(lambda machine: machine.unit.records.period) == 30000
    for period in (float("nan"), float("inf")):
        with pytest.raises(GclibError, match="out of range"):
            g.GRecordRate(period)


def test_arrays_are_downloaded_and_uploaded(g: gclib.py, tmp_path: Path) -> None:
    g.GCommand("DM a[3],b[2]")
    g.GArrayDownload("a", -1, -1, [1, 2.5, -3])
    g.GArrayDownload("a", 1, 1, [7])
    assert g.GArrayUpload("a", -1, -1) == [1.0, 7.0, -3.0]
    assert g.GArrayUpload("a", 1, 2) == [7.0, -3.0]
    path = str(tmp_path / "t.csv")
    g.GArrayUploadFile(path, ["a"])
    assert (tmp_path / "t.csv").read_text(encoding="ascii") == "a\n1.0000\n7.0000\n-3.0000\n"
    g.GArrayUploadFile(path)
    g.GCommand("DA *[0];DM a[9]")
    g.GArrayDownloadFile(path)
    assert g.GArrayUpload("a", -1, -1) == [1.0, 7.0, -3.0]
    assert g.GArrayUpload("b", -1, -1) == [0.0, 0.0]


@pytest.mark.parametrize(
    ("name", "first", "last", "values"),
    [("none", -1, -1, [1.0]), ("a", 0, 2, [1.0]), ("a", -1, -1, [0.0] * 4), ("a", 3, -1, [1.0]), ("a", -1, -1, [])],
)
def test_an_array_that_does_not_fit(g: gclib.py, name: str, first: int, last: int, values: list[float]) -> None:
    g.GCommand("DM a[3]")
    with pytest.raises(GclibError, match="array not dimensioned on controller or wrong size"):
        g.GArrayDownload(name, first, last, values)


@pytest.mark.parametrize(("first", "last"), [(0, 3), (2, 1)])
def test_elements_that_are_not_there(g: gclib.py, first: int, last: int) -> None:
    g.GCommand("DM a[3]")
    with pytest.raises(GclibError, match="array not dimensioned"):
        g.GArrayUpload("a", first, last)


def test_the_end_of_a_motion_is_waited_for(twin: ServedTwin, g: gclib.py) -> None:
    g.GCommand("SH;PRA=2000;PRB=-1000;BGAB")
    g.GMotionComplete("A,B")
    assert twin.look(lambda machine: [axis.moving for axis in machine.unit.axes]) == [False] * 3
    assert g.GCommand("TPA") == "2000"
    g.GCommand("CAS;LMAB;LI 100,100;LE;BGS")
    g.GMotionComplete("S")
    assert g.GCommand("TPA") == "2100"


def test_closing_gives_both_handles_back_and_may_be_repeated(twin: ServedTwin) -> None:
    g = gclib.py()
    g.GOpen(f"{twin.address} -s ALL")
    g.GClose()
    g.GClose()
    kinds = twin.look(lambda machine: [handle.kind for handle in machine.unit.handles if handle is not None])
    assert HandleProtocol.UDP not in kinds
    g.GOpen(twin.address)
    assert g.GCommand("MG 1") == "1.0000"
    del g


def test_cut_link_is_reported(twin: ServedTwin, g: gclib.py) -> None:
    twin.do(lambda controller: controller.cut())
    with pytest.raises(GclibError, match="connection to hardware not established"):
        g.GCommand("TP")


def test_late_answer_is_not_taken_for_the_next() -> None:
    """The first connection never answers; after the timeout a new one serves."""

    def serve() -> None:
        first, _ = listener.accept()
        first.recv(100)
        first.sendall(b":")  # to EO 0
        first.recv(100)
        second, _ = listener.accept()
        with first, second:
            second.recv(100)
            second.sendall(b" 2.0000\r\n:")

    with socket.create_server(("127.0.0.1", 0)) as listener:
        thread = threading.Thread(target=serve)
        thread.start()
        g = gclib.py()
        g.GOpen(f"127.0.0.1:{listener.getsockname()[1]} -t 300")
        with pytest.raises(GclibError, match="device timed out"):
            g.GCommand("MG 1")
        assert g.GCommand("MG 2") == "2.0000"
        thread.join()
        g.GClose()


def test_interrupts_are_status_bytes() -> None:
    """A controller that sends one by UDP; the twin has none."""

    def serve() -> None:
        connection, _ = listener.accept()
        with connection:
            connection.recv(100)
            connection.sendall(b":")  # to EO 0
            hello, sender = datagrams.recvfrom(100)
            assert hello == b"WH\r"
            datagrams.sendto(b"IHB\r\n:", sender)
            datagrams.sendto(b"\x01\xf1\xd8\x16", sender)
            connection.recv(100)
            connection.sendall(b":")

    with socket.create_server(("127.0.0.1", 0)) as listener, socket.socket(type=socket.SOCK_DGRAM) as datagrams:
        port = listener.getsockname()[1]
        datagrams.bind(("127.0.0.1", 0))
        thread = threading.Thread(target=serve)
        thread.start()
        g = gclib.py()
        g.GOpen(f"127.0.0.1 --p1 {port} --p2 {datagrams.getsockname()[1]} -s EI")
        assert (g.GInterrupt(), g.GInterrupt()) == (0xF1, 0xD8)
        g.GClose()
        thread.join()
