"""Scripts for gclib over a serial port."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from dmc41x3.gclib.errors import Code, GclibError
from dmc41x3.gclib.shim import gclib
from tests.served_twin import ServedTwin, served

PROGRAM = '#A\nMG "one"\nMG "two",3\nEN\n'


@pytest.fixture
def plugged() -> Iterator[tuple[ServedTwin, str]]:
    with served() as twin:
        yield twin, twin.do(lambda controller: controller.serve_serial())


@pytest.mark.parametrize(
    "address", ["{path}", "{path} --baud 115200 -d", "-a {path} -b 19200", "COM7 --handshake HARD"]
)
def test_script_opens_a_port_in_every_notation(
    plugged: tuple[ServedTwin, str], address: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    _, path = plugged
    monkeypatch.setenv("DMC_COM7", path)
    g = gclib.py()
    g.GOpen(address.format(path=path))
    try:
        assert g.GInfo() == f"{path}, DMC4133 Rev 1.3k, 41330, USB"
        assert g.GCommand("SH;PRA=100;MG _PRA") == "100.0000"
        assert g.GRecord("QR").axis_a_motor_position == 0
        with pytest.raises(GclibError):
            g.GCommand("XX")
        assert g.GCommand("TC1").startswith("1 ")
    finally:
        g.GClose()


def test_programs_arrays_and_messages(plugged: tuple[ServedTwin, str]) -> None:
    g = gclib.py()
    g.GOpen(f"{plugged[1]} -s MG -t 3000")
    try:
        g.GProgramDownload(PROGRAM)
        assert g.GProgramUpload().splitlines() == PROGRAM.splitlines()
        g.GCommand("DM table[3]")
        g.GArrayDownload("table", -1, -1, [1.0, 2.0, 3.5])
        assert g.GArrayUpload("table", -1, -1) == [1.0, 2.0, 3.5]
        g.GCommand("XQ #A")
        said = g.GMessage()
        while said.count("\n") < 2:
            said += g.GMessage()
        assert said == "one\r\ntwo 3.0000\r\n"
        with pytest.raises(GclibError) as caught:
            g.GRecord("DR")
        assert caught.value.code is Code.UNSUPPORTED_FUNCTION
    finally:
        g.GClose()


def test_port_of_another_program_fails_to_open(plugged: tuple[ServedTwin, str]) -> None:
    first, second = gclib.py(), gclib.py()
    first.GOpen(plugged[1])
    with pytest.raises(GclibError, match="device failed to open") as caught:
        second.GOpen(plugged[1])
    assert "another program uses it" in caught.value.detail
    first.GClose()
    second.GOpen(plugged[1])
    second.GClose()
