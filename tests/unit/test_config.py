"""Configuration: the manual's values, one file over them, and refusals with key, value and reason."""

from __future__ import annotations

import tomllib
from collections.abc import Iterator, Mapping
from math import inf, nan, pi, radians, tau
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import BaseModel, ValidationError

from maya_un.config import AxisConfig, Config, default_path, for_people, load, template, to_toml
from maya_un.config.files import parse
from maya_un.config.model import BoxConfig, parse_zone
from maya_un.errors import FileUnreadable, InvalidConfig, InvalidRequest


@pytest.fixture(autouse=True)
def no_configuration_of_mine(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Path:
    """Keep the user's own file out of the tests; return the folder that stands for the user's."""
    monkeypatch.delenv("MAYA_CONFIG", raising=False)
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "user"))
    return tmp_path / "user" / "maya"


def nested(dotted: str, value: object) -> dict[str, Any]:
    """Return {"a": {"b": value}} for "a.b"."""
    *sections, key = dotted.split(".")
    keys: dict[str, Any] = {key: value}
    for section in reversed(sections):
        keys = {section: keys}
    return keys


def axes(config: Config) -> tuple[AxisConfig, AxisConfig, AxisConfig]:
    return config.axes.a, config.axes.b, config.axes.c


def refusal(keys: dict[str, Any]) -> Mapping[str, object]:
    with pytest.raises(InvalidConfig) as caught:
        parse(keys)
    return caught.value.details


def sections(model: BaseModel) -> list[BaseModel]:
    inner = [getattr(model, name) for name in type(model).model_fields]
    return [model, *(part for child in inner if isinstance(child, BaseModel) for part in sections(child))]


ZONES: list[dict[str, Any]] = [
    {"name": "rack", "kind": "box", "low": [0.1, 1.0, 0.0], "high": [0.3, 1.5, 0.6], "margin": 0.0},
    {"name": "post", "kind": "cylinder", "x": 1.2, "y": 0.3, "radius": 0.05, "low": 0.0, "high": 2.0, "lines": False},
    {"name": "wall-1", "kind": "half_space", "point": [0.0, 0.1, 0.0], "normal": [0.0, 1.0, 1e-07], "lines": True},
]


def zone(number: int, **changed: object) -> dict[str, Any]:
    return {"zones": [ZONES[number] | changed]}


def test_the_defaults_are_the_manuals() -> None:
    config = Config()
    lengths = config.geometry
    assert (lengths.height, lengths.length, lengths.delta, lengths.gripper_height) == (2.35, 2.30, 0.30, 0.20)
    strokes = [(axis.minimum, axis.maximum) for axis in axes(config)]
    assert strokes == [(0.0, 2 * pi / 3), (0.575, 2.260), (0.565, 2.300)]
    assert (config.scale.pulses_per_metre, config.scale.pulses_per_degree) == (1e6, 371.06)
    speeds = [(axis.speed_counts, axis.acceleration_counts, axis.deceleration_counts) for axis in axes(config)]
    assert speeds == [(1000, 1024, 1024), (45000, 5120, 5120), (45000, 5120, 5120)]
    assert (config.controller.address, config.gripper.closed_by) == ("192.168.1.156", "clear")


def test_the_defaults_are_those_that_the_errata_add() -> None:
    config = Config()
    assert [axis.stop_deceleration_counts for axis in axes(config)] == [10_240, 51_200, 51_200]
    assert (config.safety.tension_limit, config.safety.self_locking, config.safety.oe) == (5.0, True, 1)
    assert (config.cell.grasp_height, config.cell.clearance) == (0.40, 0.10)
    assert config.geometry.width == pytest.approx(2.0)


@pytest.mark.parametrize("model", sections(Config()), ids=lambda model: type(model).__name__)
def test_nothing_can_be_changed_afterwards(model: BaseModel) -> None:
    name = next(iter(type(model).model_fields))
    with pytest.raises(ValidationError, match="frozen"):
        setattr(model, name, getattr(model, name))


@pytest.mark.parametrize("model", sections(Config())[1:], ids=lambda model: type(model).__name__)
def test_every_key_has_a_description(model: BaseModel) -> None:
    fields = type(model).model_fields.items()
    leaves = [field for name, field in fields if not isinstance(getattr(model, name), BaseModel)]
    assert all(field.description for field in leaves)


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("geometry.height", 2350.0),
        ("geometry.length", 2300),
        ("geometry.delta", 300.0),
        ("geometry.gripper_height", 200.0),
        ("axes.b.maximum", 2260.0),
        ("axes.c.minimum", 565.0),
        ("homing.speed", 30.0),
        ("homing.slow_speed", 2.0),
        ("cell.clearance", 100.0),
        ("controller.timeout", 2000.0),
    ],
)
def test_a_millimetre_where_a_metre_belongs_is_refused(key: str, value: float) -> None:
    said = refusal(nested(key, value))
    assert (said["key"], float(str(said["value"]))) == (key, value)
    of_a_length = key.startswith(("geometry.", "cell.", "axes."))
    right = f"no robot reaches {value:g} m; for mm write {value:g} mm" if of_a_length else "it must be at most"
    assert str(said["reason"]).startswith(right)


def test_lengths_and_angles_take_units() -> None:
    written = {"geometry": {"height": "2360 mm"}, "axes": {"a": {"maximum": "110 deg"}, "b": {"maximum": "226 cm"}}}
    config = parse(written)
    assert config.geometry.height == 2.36
    assert (config.axes.a.maximum, config.axes.b.maximum) == (pytest.approx(radians(110.0)), pytest.approx(2.26))
    box = {"name": "lamp", "kind": "box", "low": ["100 mm", 1.0, 0], "high": ["0.2 m", "110 cm", 0.1], "margin": "5 mm"}
    (zone,) = parse({"zones": [box]}).zones
    assert isinstance(zone, BoxConfig)
    assert (zone.low, zone.high, zone.margin) == ((0.1, 1.0, 0.0), (0.2, 1.1, 0.1), 0.005)


@pytest.mark.parametrize("degrees", [120.0, 11, 7.0])
def test_a_degree_where_a_radian_belongs_is_refused(degrees: float) -> None:
    said = refusal(nested("axes.a.maximum", degrees))
    assert (said["key"], said["value"]) == ("axes.a.maximum", str(degrees))


def test_an_angle_that_looks_like_degrees_is_called_so() -> None:
    assert "looks like degrees" in str(refusal(nested("axes.a.maximum", 7.0))["reason"])


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("geometry.height", 0.0),
        ("geometry.height", -2.35),
        ("axes.a.minimum", -3.2),
        ("axes.b.minimum", -0.1),
        ("axes.a.speed_counts", 1),
        ("axes.b.acceleration_counts", 1023),
        ("axes.b.jerk_counts", 1023),
        ("axes.b.stop_deceleration_counts", 1_073_740_801),
        ("axes.c.error_limit_counts", 0),
        ("axes.c.letter", "D"),
        ("controller.stream_rate", 0.0),
        ("controller.stream_rate", 1e-9),
        ("controller.stream_rate", 0.999),
        ("scale.pulses_per_metre", 1.0),
        ("gripper.output", 9),
        ("gripper.closed_by", "CB"),
        ("wiring.limit_active_level", 0),
        ("safety.tension_limit", 1.0),
        ("safety.off_on_error", 2),
        ("safety.off_on_error", 3),
        ("homing.torque_per_load", 10.0),
    ],
)
def test_a_value_out_of_range_is_refused_by_its_key(key: str, value: object) -> None:
    assert refusal(nested(key, value))["key"] == key


@pytest.mark.parametrize("value", [nan, inf, -inf])
@pytest.mark.parametrize("key", ["geometry.height", "homing.speed", "axes.b.maximum", "controller.timeout"])
def test_invalid_number_is_refused(key: str, value: float) -> None:
    assert refusal(nested(key, value))["key"] == key


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("geometry.height", "2.35"),
        ("geometry.height", True),
        ("geometry.height", [2.35]),
        ("axes.a.speed_counts", 1000.5),
        ("axes.a.speed_counts", "1000"),
        ("gripper.output", True),
        ("safety.self_locking", "no"),
        ("safety.self_locking", 1),
        ("controller.address", 5),
        ("axes", 3),
        ("geometry", "flat"),
    ],
)
def test_a_value_of_the_wrong_kind_is_refused_and_not_converted(key: str, value: object) -> None:
    assert refusal(nested(key, value))["key"] == key


def test_integer_is_accepted_as_a_length() -> None:
    assert parse(nested("geometry.height", 3)).geometry.height == 3.0


@pytest.mark.parametrize("key", ["hieght", "geometry.hieght", "axes.d.minimum", "axes.a.speed", "safety.oe"])
def test_an_unknown_key_is_refused_by_name(key: str) -> None:
    said = refusal(nested(key, 1.0))
    assert key.startswith(str(said["key"]))
    nearest = "; perhaps height" if key == "geometry.hieght" else ""
    assert said["reason"] == f"there is no such key{nearest}"


@pytest.mark.parametrize(
    ("keys", "key", "value"),
    [
        ({"geometry": {"delta": 2.4}}, "geometry.delta", "2.4"),
        ({"geometry": {"length": 0.3}}, "geometry.delta", '"300 mm"'),
        ({"geometry": {"gripper_height": 2.35}}, "geometry.gripper_height", "2.35"),
        ({"geometry": {"length": 5.0}}, "axes.b.maximum", '"2260 mm"'),
        ({"geometry": {"length": 0.8}}, "axes.b.minimum", '"575 mm"'),
        ({"geometry": {"length": 2.9}}, "axes.b.minimum", '"575 mm"'),
        ({"axes": {"c": {"minimum": 2.1}}}, "axes.c.minimum", "2.1"),
        ({"axes": {"b": {"minimum": 2.26}}}, "axes.b.minimum", "2.26"),
        ({"cell": {"grasp_height": 2.1}}, "cell.grasp_height", "2.1"),
        ({"axes": {"b": {"letter": "A"}}}, "axes.b.letter", '"A"'),
        ({"axes": {"a": {"minimum": -1.0, "maximum": 6.0}}}, "axes.a.minimum", "-1.0"),
        ({"axes": {"b": {"stop_deceleration_counts": 5119}}}, "axes.b.stop_deceleration_counts", "5119"),
        ({"safety": {"self_locking": False, "off_on_error": 1}}, "safety.off_on_error", "1"),
    ],
)
def test_keys_that_contradict_each_other_are_refused(keys: dict[str, Any], key: str, value: str) -> None:
    said = refusal(keys)
    assert (said["key"], said["value"]) == (key, value)


@pytest.mark.parametrize(
    ("keys", "value", "reason"),
    [
        ({"geometry": {"length": 2.9}, "axes": {"b": {"minimum": "580 mm"}}}, '"580 mm"', "2925 mm or more"),
        ({"geometry": {"length": 2.9}, "axes": {"b": {"minimum": 0.58}}}, "0.58", "2925 mm or more"),
        (nested("axes.b.minimum", "1900 mm"), '"2260 mm"', "homing needs a stroke of 500 mm or more"),
        (
            {"axes": {"a": {"switches": "none", "minimum": "0 deg", "maximum": "9 deg"}}},
            '"9 deg"',
            "to be given a datum, the axis needs a stroke of 9.2° or more",
        ),
        (
            {"axes": {"a": {"switches": "none"}, "b": {"minimum": "1900 mm", "maximum": "1989 mm"}}},
            '"1989 mm"',
            "needs a stroke of 90 mm or more",
        ),
        (nested("geometry.length", "650 mm"), '"575 mm"', "it must be smaller than length - delta"),
        (nested("axes.a.minimum", "190 deg"), '"190 deg"', "it must be smaller than maximum"),
        (nested("axes.a.speed_counts", "10 deg/s"), '"10 deg/s"', "it is a whole number of counts/s"),
        (
            {"axes": {"a": {"letter": "B"}}},
            '"B"',
            "axes a, b and c have the letters B, B, C; give each letter once",
        ),
        (nested("controller.input_names", ["x", "y", "x"]), '["x", "y", "x"]', "the name x appears twice"),
    ],
)
def test_a_refusal_has_the_value_as_it_was_written_and_limits_with_units(
    keys: dict[str, Any], value: str, reason: str
) -> None:
    said = refusal(keys)
    assert said["value"] == value
    assert reason in str(said["reason"])


def test_a_table_that_appears_twice_is_named(tmp_path: Path) -> None:
    place = tmp_path / "config.toml"
    place.write_text("[controller]\ntimeout = 1.0\n\n[axes.b]\n[controller]\n")
    with pytest.raises(FileUnreadable, match=r"line 5: the table \[controller\] appears twice"):
        load(place)


@pytest.mark.parametrize(
    ("keys", "key"),
    [
        (zone(0, name=""), "zones.0.name"),
        (zone(0, name="a/b"), "zones.0.name"),
        (zone(0, name=7), "zones.0.name"),
        (zone(0, kind="ball"), "zones.0.kind"),
        ({"zones": [{"name": "rack"}]}, "zones.0.kind"),
        (zone(0, low=[0.1, 1.0]), "zones.0.low.2"),
        (zone(0, low=[0.1, 1.0, "0"]), "zones.0.low.2"),
        (zone(0, low=[0.1, 1.0, nan]), "zones.0.low.2"),
        (zone(0, high=[300.0, 1.5, 0.6]), "zones.0.high.0"),
        (zone(0, high=[0.1, 1.5, 0.6]), "zones.0.low"),
        (zone(0, margin=-0.01), "zones.0.margin"),
        (zone(0, margin=50), "zones.0.margin"),
        (zone(0, lines=1), "zones.0.lines"),
        (zone(0, radius=1.0), "zones.0.radius"),
        (zone(1, radius=0.0), "zones.0.radius"),
        (zone(1, high=0.0), "zones.0.low"),
        (zone(2, normal=[0.0, 0.0, 0.0]), "zones.0.normal"),
        ({"zones": [ZONES[0], ZONES[1], ZONES[0]]}, "zones.2.name"),
        ({"zones": "rack"}, "zones"),
    ],
)
def test_invalid_zone_is_refused_by_its_key(keys: dict[str, Any], key: str) -> None:
    assert refusal(keys)["key"] == key


def test_unknown_kind_of_zone_is_refused_with_the_known_ones() -> None:
    said = refusal(zone(0, kind="ball"))
    assert (said["value"], said["reason"]) == ('"ball"', "it must be one of box, cylinder, half_space")


def test_zones_have_a_default_margin_and_keep_the_lines_out_of_solids() -> None:
    zones = parse({"zones": ZONES}).zones
    assert [(zone.margin, zone.lines) for zone in zones] == [(0.0, True), (0.05, False), (0.05, True)]


def test_a_zone_that_is_handed_in_is_read_as_one_of_the_configuration() -> None:
    assert parse_zone(ZONES[1]) == parse({"zones": ZONES}).zones[1]
    with pytest.raises(InvalidRequest, match=r"radius: .*greater than 0"):
        parse_zone(ZONES[1] | {"radius": -1.0})
    with pytest.raises(InvalidRequest, match="kind: it must be one of box"):
        parse_zone({})


def test_the_zones_of_the_how_to_page_are_good() -> None:
    page = Path(__file__).parents[2] / "docs" / "how-to" / "keep-out-of-places.md"
    example = page.read_text(encoding="utf-8").partition("```toml\n")[2].partition("```")[0]
    assert [zone.name for zone in parse(tomllib.loads(example)).zones] == ["rack", "post", "neighbour"]


def test_letters_may_be_exchanged() -> None:
    config = parse({"axes": {"a": {"letter": "C"}, "c": {"letter": "A"}}})
    assert [axis.letter for axis in axes(config)] == ["C", "B", "A"]


@pytest.mark.parametrize(
    ("locking", "chosen", "oe"), [(True, None, 1), (True, 0, 0), (True, 1, 1), (False, None, 0), (False, 0, 0)]
)
def test_off_on_error_is_used_only_if_the_drum_holds(locking: bool, chosen: int | None, oe: int) -> None:
    keys = {"self_locking": locking} | ({} if chosen is None else {"off_on_error": chosen})
    assert parse({"safety": keys}).safety.oe == oe


@pytest.mark.parametrize("address", ["robot", "robot.local:23", "10.0.0.5", "10.0.0.5:65535", "maya-1:1"])
def test_an_address_is_a_host_with_or_without_a_port(address: str) -> None:
    assert parse(nested("controller.address", address)).controller.address == address


@pytest.mark.parametrize(
    "address", ["", " ", "a b", "sim", "real", ":23", "robot:", "robot:0", "robot:65536", "robot:x", "a:1:2", "-a"]
)
def test_an_address_that_leads_nowhere_is_refused(address: str) -> None:
    assert refusal(nested("controller.address", address))["key"] == "controller.address"


def test_one_key_changes_and_all_others_stay() -> None:
    changed = parse(nested("axes.b.speed_counts", 30_000)).model_dump()
    assert changed["axes"]["b"].pop("speed_counts") == 30_000
    usual = Config().model_dump()
    del usual["axes"]["b"]["speed_counts"]
    assert changed == usual


@st.composite
def configurations(draw: st.DrawFn) -> Config:
    """Draw a configuration with many keys off their defaults."""
    deceleration = draw(st.integers(1024, 20_000))
    locking = draw(st.booleans())
    keys: dict[str, Any] = {
        "controller": {"timeout": draw(st.floats(0.0, 60.0, exclude_min=True))},
        "geometry": {"height": draw(st.floats(1.9, 10.0)), "delta": draw(st.floats(0.2, 0.5))},
        "scale": {"pulses_per_metre": draw(st.floats(1e4, 1e9))},
        "axes": {
            "a": {"maximum": draw(st.floats(0.5, 2 * pi))},
            "c": {
                "deceleration_counts": deceleration,
                "stop_deceleration_counts": deceleration + draw(st.integers(0, 50_000)),
            },
        },
        "gripper": {"closed_by": draw(st.sampled_from(["clear", "set"])), "output": draw(st.integers(1, 8))},
        "wiring": {"limit_active_level": draw(st.sampled_from([-1, 1]))},
        "safety": {"self_locking": locking} | draw(st.sampled_from([{}, {"off_on_error": 0}])),
        "zones": draw(st.lists(st.sampled_from(ZONES), unique_by=lambda zone: zone["name"])),
    }
    return parse(keys)


@given(configurations())
def test_written_and_read_again_it_is_the_same(config: Config) -> None:
    assert parse(tomllib.loads(to_toml(config))) == config


def leaves(value: object, key: str = "") -> Iterator[tuple[str, object]]:
    """Yield the values within nested data by their dotted keys."""
    inner = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list | tuple) else None
    if inner is None:
        yield key, value
        return
    for name, one in inner:
        yield from leaves(one, f"{key}.{name}")


@given(configurations(), st.booleans())
def test_what_people_read_is_nearly_the_same_configuration(config: Config, si: bool) -> None:
    again = dict(leaves(parse(tomllib.loads(for_people(config, si=si))).model_dump()))
    for key, value in leaves(config.model_dump()):
        assert again.pop(key) == (pytest.approx(value, rel=1e-10) if isinstance(value, float) else value)
    assert not again


@pytest.mark.parametrize(("minimum", "maximum"), [("-180 deg", "180 deg"), ("0 deg", "360 deg")])
def test_a_whole_turn_that_was_rounded_is_a_whole_turn(minimum: str, maximum: str) -> None:
    boom = parse({"axes": {"a": {"minimum": minimum, "maximum": maximum}}})
    text = for_people(boom, si=True)
    rounded = tomllib.loads(text)["axes"]["a"]
    assert rounded["maximum"] - rounded["minimum"] > tau
    again = parse(tomllib.loads(text)).axes.a
    assert (again.minimum, again.maximum) == (boom.axes.a.minimum, boom.axes.a.maximum)


def test_people_read_lengths_in_millimetres_and_angles_in_degrees() -> None:
    config = parse({"axes": {"a": {"minimum": "-10 deg"}, "c": {"minimum": "1400 mm"}}, "zones": [ZONES[0]]})
    lines = for_people(config).splitlines()
    assert 'minimum = "-10 deg"  # lower end of the stroke' in lines
    assert 'minimum = "1400 mm"  # lower end of the stroke' in lines
    assert "speed = 0.03  # speed of the lines during travel [m/s]" in lines
    lines = for_people(config, si=True).splitlines()
    assert "minimum = -0.174532925199  # lower end of the stroke [rad]" in lines
    assert "minimum = 1.4  # lower end of the stroke [m]" in lines


def test_the_file_to_start_from_changes_nothing() -> None:
    assert parse(tomllib.loads(template())) == Config()


def test_every_line_of_the_file_to_start_from_may_be_uncommented() -> None:
    lines = [line.removeprefix("# ") if " = " in line else line for line in template().splitlines()]
    text = "\n".join(line for line in lines if not line.startswith("#"))
    defaults = Config().model_dump(mode="json", exclude_none=True, exclude={"zones"})
    assert tomllib.loads(text) == defaults


def test_the_file_to_start_from_names_every_key() -> None:
    text = template()
    names = [name for model in sections(Config())[1:] for name in type(model).model_fields]
    lacking = [name for name in names if f"# {name} = " not in text and f"# {name}: " not in text]
    assert [name for name in lacking if name not in {"a", "b", "c"}] == []


def test_a_file_is_laid_over_the_defaults(tmp_path: Path) -> None:
    place = tmp_path / "maya.toml"
    place.write_text("[geometry]\nheight = 2.5\n", encoding="utf-8")
    assert load(place) == parse(nested("geometry.height", 2.5))


def test_without_a_file_the_defaults_serve() -> None:
    assert load() == Config()


def test_the_users_own_file_is_found(no_configuration_of_mine: Path) -> None:
    no_configuration_of_mine.mkdir(parents=True)
    (no_configuration_of_mine / "config.toml").write_text("[cell]\nclearance = 0.2\n", encoding="utf-8")
    assert load().cell.clearance == 0.2


@pytest.mark.parametrize(
    ("environment", "expected"),
    [
        ({"MAYA_CONFIG": "/x/y.toml", "XDG_CONFIG_HOME": "/c"}, "/x/y.toml"),
        ({"XDG_CONFIG_HOME": "/c"}, "/c/maya/config.toml"),
        ({"XDG_CONFIG_HOME": "", "HOME": "/home/eva"}, "/home/eva/.config/maya/config.toml"),
        ({"MAYA_CONFIG": "", "HOME": "/home/eva"}, "/home/eva/.config/maya/config.toml"),
    ],
)
def test_the_place_of_the_file(environment: dict[str, str], expected: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("XDG_CONFIG_HOME")
    for name, value in environment.items():
        monkeypatch.setenv(name, value)
    assert default_path() == Path(expected)


def test_a_file_that_is_named_must_be_there(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(FileUnreadable, match="No such file"):
        load(tmp_path / "none.toml")
    monkeypatch.setenv("MAYA_CONFIG", str(tmp_path / "none.toml"))
    with pytest.raises(FileUnreadable, match="No such file"):
        load()


@pytest.mark.parametrize(
    ("content", "reason"), [(b"height = = 2", "it is not TOML"), (b"\xff\xfe", "it is not TOML"), (b"a=1\na=2", "TOML")]
)
def test_a_broken_file_is_refused_by_its_path(content: bytes, reason: str, tmp_path: Path) -> None:
    place = tmp_path / "broken.toml"
    place.write_bytes(content)
    with pytest.raises(FileUnreadable, match=reason) as caught:
        load(place)
    assert caught.value.details["path"] == place


def test_folder_is_not_a_file(tmp_path: Path) -> None:
    with pytest.raises(FileUnreadable, match="directory"):
        load(tmp_path)


def test_unreadable_file_is_not_taken_for_a_missing_one(no_configuration_of_mine: Path) -> None:
    (no_configuration_of_mine / "config.toml").mkdir(parents=True)
    with pytest.raises(FileUnreadable, match="directory"):
        load()


@pytest.mark.parametrize("text", ["a = " + "[" * 5000, "a = " + "9" * 5000], ids=["nested", "long number"])
def test_a_file_beyond_all_bounds_is_refused_as_any_broken_one(tmp_path: Path, text: str) -> None:
    place = tmp_path / "config.toml"
    place.write_text(text)
    with pytest.raises(FileUnreadable, match="not TOML"):
        load(place)


def test_outputs_are_written_and_read_again() -> None:
    config = parse({"controller": {"outputs": [2, 3]}})
    assert parse(tomllib.loads(to_toml(config))) == config


def test_output_is_named_once() -> None:
    with pytest.raises(InvalidConfig, match="an output is named twice"):
        parse({"controller": {"outputs": [2, 2]}})


def test_the_output_of_the_gripper_is_not_one_for_primitives() -> None:
    with pytest.raises(InvalidConfig, match="it is the output of the gripper"):
        parse({"controller": {"outputs": [4, 2]}, "gripper": {"output": 4}})


@pytest.mark.parametrize("url", ["", "http://10.0.0.7:8080", "https://cam.lab.example/stream?size=640&fps=5"])
def test_address_of_a_camera_is_accepted(url: str) -> None:
    assert parse({"camera": {"url": url}}).camera.url == url


@pytest.mark.parametrize(
    "url",
    [
        *("cam", "a", "ftp://cam", "javascript:alert(1)", "http://", "http://me:secret@cam/", "http://cam/ x"),
        *("http://cam/\n", "http://cam;script-src *", "http://cam/'", "http://cam/" + "x" * 500),
    ],
)
def test_other_address_of_a_camera_is_refused(url: str) -> None:
    with pytest.raises(InvalidConfig) as caught:
        parse({"camera": {"url": url}})
    assert caught.value.details["key"] == "camera.url"


@pytest.mark.parametrize(
    ("text", "where"),
    [
        ("[geometry]\n# in metres\nheight = 900\n", "geometry.height (machine.toml, line 3)"),
        ("geometry.height = 900\n", "geometry.height (machine.toml, line 1)"),
        ("[geometry]\n\n[axes.b]\nminimum = -1\n", "axes.b.minimum (machine.toml, line 4)"),
        ('[[zones]]\nname = "a"\nkind = "box"\n', "zones.0.low (machine.toml, line 1)"),
        ("[cell]\nclearence = 0.1\n", "cell.clearence (machine.toml, line 2)"),
        ("[tower]\nheight = 1\n", "tower (machine.toml, line 1)"),
        ("[geometry]\nlength = 5.0\n", 'axes.b.maximum = "2260 mm"'),
    ],
)
def test_error_in_a_file_has_its_line(tmp_path: Path, text: str, where: str) -> None:
    """The last one contradicts a key that the file does not have."""
    file = tmp_path / "machine.toml"
    file.write_text(text)
    with pytest.raises(InvalidConfig) as caught:
        load(file)
    assert f" at {where}" in str(caught.value)
    assert where.startswith(str(caught.value.details["key"]))


@pytest.mark.parametrize(
    ("keys", "key", "reason"),
    [
        ({"geometry": {"height": 1.3}}, "axes.b.maximum", "too long for the height"),
        ({"geometry": {"length": 1.45}}, "axes.b.maximum", "too long for the height"),
        ({"axes": {"b": {"minimum": 0.1}}}, "axes.b.minimum", "200 mm or more"),
        ({"axes": {"b": {"minimum": 1.9}}}, "axes.b.maximum", "a stroke of 500 mm or more"),
        ({"geometry": {"length": 2.9}}, "axes.b.minimum", "2925 mm or more"),
        ({"homing": {"stroke_tolerance": 0.2}, "axes": {"c": {"maximum": 2.09}}}, "axes.b.minimum", "2250 mm or more"),
        (
            {"geometry": {"length": 0.6}, "axes": {"b": {"minimum": 0.1}, "c": {"minimum": 0.1}}},
            *("geometry.length", "400 mm or more"),
        ),
    ],
)
def test_machine_that_cannot_be_homed_is_refused(keys: dict[str, Any], key: str, reason: str) -> None:
    said = refusal(keys)
    assert said["key"] == key
    assert reason in str(said["reason"])
