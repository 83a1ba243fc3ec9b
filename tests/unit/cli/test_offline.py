"""fk, ik, reach and config: no robot needed."""

from __future__ import annotations

import json
import tomllib
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from maya_un import runtime
from maya_un.cli.main import main
from maya_un.config import Config
from maya_un.kinematics.ranges import Ranges
from maya_un.kinematics.workspace import Workspace
from maya_un.runtime import Running
from maya_un.service.margins import reached
from maya_un.service.reachability import reach_of
from maya_un.values import Joints, Point
from tests.unit.cli.servers import http_service


def answered(line: str, capsys: pytest.CaptureFixture[str], code: int = 0) -> dict[str, object]:
    """Return what a command prints as JSON."""
    assert main([*line.split(), "--json"]) == code
    return json.loads(capsys.readouterr().out)


def test_fk_and_ik_are_each_others_inverse(capsys: pytest.CaptureFixture[str]) -> None:
    joints = answered("ik 0.5 1.2 0.4", capsys)
    point = answered(f"fk {joints['a']} {joints['b']} {joints['c']}", capsys)
    assert point == pytest.approx({"x": 0.5, "y": 1.2, "z": 0.4}, abs=1e-12)


def test_units_say_the_same(capsys: pytest.CaptureFixture[str]) -> None:
    assert answered("ik 500mm 120cm 0.4m", capsys) == pytest.approx(answered("ik 0.5 1.2 0.4", capsys))


def test_a_negative_number_is_a_value(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["ik", "-0.2", "1.1", "0.4"]) == 1
    assert "error 2101" in capsys.readouterr().err


def test_reach_names_reason_and_nearest(capsys: pytest.CaptureFixture[str]) -> None:
    found = answered("reach 0 2.2 2.3", capsys, code=1)
    nearest = found["nearest"]
    assert found["reachable"] is False
    assert found["joints"] is None
    assert found["reason"]
    assert isinstance(nearest, dict)
    there = answered(f"reach {nearest['x']} {nearest['y']} {nearest['z']}", capsys)
    assert (there["reachable"], there["reason"]) == (True, None)


def test_reach_shows_the_meeting_point_of_the_lines(capsys: pytest.CaptureFixture[str]) -> None:
    reason = answered("reach 0.5 1.2 2.2", capsys, code=1)["reason"]
    assert reason == "its lines would have to meet 50 mm above their anchors"


def test_reach_and_ik_keep_out_of_the_zones_of_the_running_robot(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    rack = {"name": "rack", "kind": "box", "low": [0.4, 1.1, 0.0], "high": [0.6, 1.3, 0.6]}
    config = Config.model_validate({"zones": [rack]}).model_dump(mode="json")
    with http_service(lambda *_: (200, config)) as url:
        monkeypatch.setattr(runtime, "find", lambda: Running(url, 1, None))
        monkeypatch.setattr(runtime, "claimant", lambda: 1)
        assert "rack" in str(answered("reach 0.5 1.2 0.4", capsys, code=1)["reason"])
        assert main(["ik", "0.5", "1.2", "0.4"]) == 1
        assert "rack" in capsys.readouterr().err
        (tmp_path / "maya.toml").write_text("")
        assert answered(f"reach 0.5 1.2 0.4 --config {tmp_path / 'maya.toml'}", capsys)["reachable"] is True
    monkeypatch.setattr(runtime, "find", lambda: Running(url, 1, None))
    monkeypatch.setattr(runtime, "claimant", lambda: 1)
    assert answered("reach 0.5 1.2 0.4", capsys)["reachable"] is True


def test_people_get_degrees_and_millimetres(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["reach", "0.5", "1.2", "0.4"]) == 0
    assert "reachable: a 22.6199°" in capsys.readouterr().out


def test_reach_shows_the_distance_to_every_limit_and_the_tensions(capsys: pytest.CaptureFixture[str]) -> None:
    # In the middle, 1.25 below the anchors: b = c = 1.6008, T = b/2h = 0.640 on both lines, 30° into the boom's range.
    assert main(["reach", "0.65", "1.12583302", "0.9"]) == 0
    out = capsys.readouterr().out
    assert "line b carries 0.640 × load, line c 0.640 × load" in out
    rows = dict(line.rsplit("  ", 1) for line in out.split("\n\n")[1].splitlines()[1:])
    found = {name.strip(): margin.strip() for name, margin in rows.items()}
    assert found["range of the boom"] == "30.000°"
    assert found["inner anchor"] == found["outer anchor"] == "1000.0 mm"
    assert found["table top"] == "900.0 mm"
    assert found["ends of line b"] == "659.2 mm"
    assert found["tension of line c"] == "4.360 × load"


def test_reach_speaks_spanish_down_to_the_unit_of_tension(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["reach", "0.5", "1.2", "1.0", "--lang", "es"]) == 0
    out = capsys.readouterr().out
    assert "load" not in out and out.count("4.337 × carga") == 2


def test_reach_shows_all_broken_limits(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["reach", "0", "1.3", "-0.05"]) == 1
    first, *others = capsys.readouterr().out.splitlines()
    assert first.startswith("not reachable: it lies 50 mm below the table top; nearest x")
    assert [line.split(" would")[0] for line in others] == ["also: line b", "also: line c"]
    found = answered("reach 0 1.3 -0.05", capsys, code=1)
    broken = found["broken"]
    assert isinstance(broken, list)
    assert [(one["limit"], one["unit"]) for one in broken] == [("floor", "m"), ("line_b", "m"), ("line_c", "m")]
    assert broken[0]["excess"] == pytest.approx(0.05)
    assert (found["margins"], found["tensions"]) == ([], None)


def test_reach_knows_the_zones_of_the_configuration(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "c.toml"
    zone = '[[zones]]\nname = "{}"\nkind = "half_space"\npoint = [0, 0, {}]\nnormal = [0, 0, 1]\n'
    file.write_text(zone.format("crates", 0.5))
    inside = answered(f"reach 0.5 1.2 0.4 --config {file}", capsys, code=1)
    assert inside["nearest"] == pytest.approx({"x": 0.5, "y": 1.2, "z": 0.55}, abs=1e-3)
    broken = inside["broken"]
    assert isinstance(broken, list)
    assert (broken[0]["limit"], broken[0]["zone"], broken[0]["excess"]) == ("zone", "crates", pytest.approx(0.15))
    assert main(["reach", "0.5", "1.2", "0.6", "--config", str(file)]) == 0
    assert "zone crates" in capsys.readouterr().out
    file.write_text(zone.format("all", 3.0))
    assert main(["reach", "0.5", "1.2", "0.6", "--config", str(file)]) == 1
    assert "nearest none: the zones cover the whole workspace" in capsys.readouterr().out
    assert answered(f"reach 0.5 1.2 0.6 --config {file}", capsys, code=1)["nearest"] is None


def test_config_init_writes_a_valid_file_and_never_overwrites(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = str(tmp_path / "new" / "maya.toml")
    assert main(["config", "init", file]) == 0
    assert main(["config", "check", file]) == 0
    assert main(["config", "init", file]) == 2
    said = capsys.readouterr().err
    assert "error 5018" in said
    assert "Edit it, or name another file: `maya config init FILE`." in said


def test_config_show_is_toml_in_force(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "c.toml"
    file.write_text("[cell]\nclearance = 0.2\n")
    for units, shown in (("mm", "200 mm"), ("si", 0.2)):
        assert main(["config", "show", "--config", str(file), "--units", units]) == 0
        printed = capsys.readouterr().out
        assert tomllib.loads(printed)["cell"]["clearance"] == shown
        (tmp_path / "printed.toml").write_text(printed)
        assert main(["config", "check", str(tmp_path / "printed.toml")]) == 0
        capsys.readouterr()


def test_config_check_without_a_file_says_that_the_defaults_hold(capsys: pytest.CaptureFixture[str]) -> None:
    assert answered("config check", capsys)["exists"] is False


def test_the_configuration_named_is_the_one_used(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "c.toml"
    file.write_text("[safety]\ntension_limit = 2.0\n")
    assert answered("reach 0 1.3 2.0", capsys)["reachable"] is True
    assert answered(f"reach 0 1.3 2.0 --config {file}", capsys, code=1)["reachable"] is False


@given(x=st.floats(-0.5, 2.0), y=st.floats(0.5, 2.0), z=st.floats(0.0, 2.0))
def test_the_ranges_of_the_manual_reach_as_the_workspace_of_the_defaults(x: float, y: float, z: float) -> None:
    point, ranges = Point(x, y, z), Ranges.of_the_manual()
    whole = reach_of(Workspace.of(Config()), point)
    joints = ranges.mechanism.ik(point) if whole.reachable else Joints(0.0, 0.0, 0.0)
    assert ranges.within(joints) is whole.reachable
    if whole.reachable:
        assert reached(ranges, joints, point) == whole


@given(a=st.floats(-0.5, 4.0), b=st.floats(0.2, 3.0), c=st.floats(0.2, 3.0))
def test_ranges_are_the_workspace_without_zones(a: float, b: float, c: float) -> None:
    config, joints = Config(), Joints(a, b, c)
    ranges, workspace = Ranges.configured(config), Workspace.of(config)
    assert ranges.within(joints) is workspace.contains(joints)
    if ranges.within(joints):
        assert ranges.mechanism.fk(joints) == workspace.fk(joints)


def test_the_manuals_ranges_are_those_of_the_default_configuration() -> None:
    assert Ranges.of_the_manual() == Ranges.configured(Config())


@pytest.mark.parametrize(
    "line", ["fk 0.5 1.5 1.5", "ik 0.5 1.1 0.9", "ik 0 1.3 2.149", "fk 0.5deg 1500mm 1.2", "ik -1 -1 1"]
)
def test_fk_and_ik_answer_alike_with_an_empty_file(
    line: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "c.toml"
    file.write_text("")
    said: list[tuple[object, ...]] = []
    for words in (line, f"{line} --json"):
        for end in ("", f" --config {file}"):
            code = main(f"{words}{end}".split())
            said.append((code, *capsys.readouterr()))
    assert said[0] == said[1]
    assert said[2] == said[3]


def test_the_configuration_of_the_user_counts_for_fk(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path))
    monkeypatch.delenv("MAYA_CONFIG", raising=False)
    file = tmp_path / "maya" / "config.toml"
    file.parent.mkdir()
    file.write_text("[axes.b]\nmaximum = 1.2\n")
    assert main(["fk", "0.5", "1.5", "1.5"]) != 0
    assert main(["ik", "0.5", "1.1", "0.9"]) != 0
