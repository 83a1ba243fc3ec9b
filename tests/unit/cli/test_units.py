"""Lengths and angles in the output: one unit system at a time."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from maya_un.cli.settings import OutputSettings, from_environment, split
from maya_un.cli.units import MILLIMETRES, SI, units_of
from maya_un.errors import InvalidCommandLine, InvalidValue

JOINTS = (0.5235987755982988, 1.5, 1.3)


def test_millimetres_and_degrees_by_default() -> None:
    units = units_of(OutputSettings())
    assert units.joints(JOINTS) == "a 30.00°  b 1500.0 mm  c 1300.0 mm"
    assert units.point((0.0503, -0.2, 0.4)) == "x 50.3 mm  y -200.0 mm  z 400.0 mm"
    assert (units.place((1.0, 0.5, 0.403)), units.place(None), units.of_length) == ("1000.0 500.0 403.0", "–", "mm")


def test_metres_and_radians_on_request() -> None:
    units = units_of(OutputSettings(units="si"))
    assert units.joints(JOINTS) == "a 0.5236 rad  b 1.5000 m  c 1.3000 m"
    assert units.place((1.0, 0.5, 0.403), finer=1) == "1.00000 0.50000 0.40300"
    assert units.of_length == "m"


@given(st.floats(-10.0, 10.0))
def test_both_systems_say_the_same(metres: float) -> None:
    in_mm, in_m = float(MILLIMETRES.bare_length(metres)), float(SI.bare_length(metres))
    assert in_mm == pytest.approx(in_m * 1e3, abs=0.11)
    assert not MILLIMETRES.length(metres).startswith("-0.0 ")


def test_option_and_variable_choose(monkeypatch: pytest.MonkeyPatch) -> None:
    assert split(["status", "--units", "si"], OutputSettings())[0].units == "si"
    monkeypatch.setenv("MAYA_UNITS", "SI")
    assert from_environment().units == "si"
    assert split(["status", "--units=mm"], from_environment())[0].units == "mm"
    monkeypatch.setenv("MAYA_UNITS", "furlong")
    assert from_environment().units == "mm"


def test_unknown_units_are_refused() -> None:
    with pytest.raises(InvalidValue, match="mm, si"):
        split(["--units", "inch", "status"], OutputSettings())
    with pytest.raises(InvalidCommandLine):
        split(["status", "--units"], OutputSettings())
