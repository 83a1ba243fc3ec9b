from __future__ import annotations

from math import pi

import numpy as np
import pytest

from maya_un.config import Config, Units
from maya_un.config.files import parse
from maya_un.errors import UnknownName
from maya_un.kinematics import Mechanism
from maya_un.kinematics.calibration import FITTED, FittedConstants, model, named
from maya_un.kinematics.calibration.parameters import listed
from tests.unit.kinematics.calibration.bench import CONFIG, NOW, TRUTH, random_counts


def with_keys(keys: dict[str, float]) -> Config:
    nested: dict[str, object] = {}
    for key, value in keys.items():
        *sections, name = key.split(".")
        at = nested
        for section in sections:
            below = at.setdefault(section, {})
            assert isinstance(below, dict)
            at = below
        at[name] = value
    return parse(nested)


def test_configured_values_need_no_change() -> None:
    assert NOW.keys(CONFIG) == {}


def test_a_zero_moves_both_ends_of_its_stroke() -> None:
    assert NOW._replace(zero_b=-0.004).keys(CONFIG) == {"axes.b.minimum": 0.571, "axes.b.maximum": 2.256}


def test_a_scale_leaves_the_ends_of_the_strokes_at_their_counts() -> None:
    keys = NOW._replace(pulses_per_metre=1.25e6).keys(CONFIG)
    assert keys == {
        "scale.pulses_per_metre": 1.25e6,
        "axes.b.minimum": 0.46,
        "axes.b.maximum": 1.808,
        "axes.c.minimum": 0.452,
        "axes.c.maximum": 1.84,
    }


def test_axis_a_converts_by_degrees() -> None:
    keys = NOW._replace(pulses_per_degree=371.06 / 2, zero_a=0.01).keys(CONFIG)
    assert keys["axes.a.minimum"] == pytest.approx(0.01)
    assert keys["axes.a.maximum"] == pytest.approx(4 * pi / 3 + 0.01)


def test_after_the_next_homing_the_whole_system_agrees_with_the_fit() -> None:
    """Homing redefines the counts at the switches; the same places of the machine then have the fitted joints."""
    counts = random_counts(np.random.default_rng(2), 50)
    after = with_keys(TRUTH.keys(CONFIG))
    at_switch = [
        np.array([config.axes[axis].minimum * Units.of(config).per_unit[axis] for axis in range(3)])
        for config in (CONFIG, after)
    ]
    joints = (counts - at_switch[0] + at_switch[1]) / np.array(Units.of(after).per_unit)
    assert np.allclose(joints, model.joints(TRUTH, counts), rtol=0.0, atol=1e-8)
    assert np.allclose(Mechanism.of(after).fk_many(joints), model.points(TRUTH, counts), rtol=0.0, atol=1e-7)


@pytest.mark.parametrize(
    ("text", "name"),
    [("phi", "gripper_height"), ("H", "height"), ("D", "length"), ("Delta", "delta"), ("zero-b", "zero_b")],
)
def test_the_letters_of_the_formulas_are_understood(text: str, name: str) -> None:
    assert named(text) == name


@pytest.mark.parametrize("name", FITTED)
def test_every_constant_is_known_by_its_name(name: str) -> None:
    assert named(name) == name


def test_an_unknown_constant_lists_those_that_are() -> None:
    with pytest.raises(UnknownName, match="gripper_height"):
        named("line_difference")


def test_constants_are_listed_in_order() -> None:
    assert listed(["zero_b", "length", "zero_a"]) == "length (D), zero of a and zero of b"
    assert listed(["delta"]) == "delta (Δ)"


def test_only_nine_constants_are_fitted() -> None:
    assert FittedConstants._fields[:9] == FITTED
