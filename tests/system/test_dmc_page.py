"""The page for people who own a Galil and no Maya: its programs run as they stand."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

from tests.ports import free_port

pytestmark = pytest.mark.system

PAGE = Path(__file__).parents[2] / "docs" / "how-to" / "use-a-galil-without-maya.md"
DMC = str(Path(sys.executable).with_name("dmc"))
DRIVER, STREAM, TWIN = re.findall(r"```python\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)


def printed(program: str) -> list[str]:
    """Return the lines that a program prints."""
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=100, check=False)
    assert (done.returncode, done.stderr) == (0, "")
    return done.stdout.splitlines()


def printed_beside_a_twin(program: str) -> list[str]:
    """Return the lines that a program prints while `dmc serve` runs."""
    port = free_port()
    with subprocess.Popen([DMC, "serve", "--port", str(port)], stdout=subprocess.PIPE, text=True) as twin:
        try:
            assert twin.stdout is not None
            assert twin.stdout.readline() == f"127.0.0.1:{port}\n"
            return printed(program.replace("5023", str(port)))
        finally:
            twin.terminate()


def test_the_program_with_the_driver_moves_the_axis_and_shows_a_refusal() -> None:
    moved, refused = printed_beside_a_twin(DRIVER)
    assert float(moved.split()[1]) == pytest.approx(2000.0, abs=20.0)
    assert refused.startswith("1004 ")


def test_the_program_with_the_stream_receives_records_by_udp() -> None:
    *positions, way = printed_beside_a_twin(STREAM)
    assert positions
    assert set(positions) == {"0"}
    assert way.startswith("DR by UDP ")


def test_the_program_with_the_twin_moves_for_a_minute_of_virtual_time() -> None:
    assert printed(TWIN) == ["60000.0"]
