"""The size of the section and of the workspace against counting, and the distance to its edge."""

from __future__ import annotations

from math import dist, hypot, pi, sqrt

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from maya_un.config import Config
from maya_un.kinematics import Floats, Section, Workspace
from tests.campaign import Campaign
from tests.strategies import WORKSPACE, configuration

MACHINES = {
    "manual": WORKSPACE,
    "weak lines": Workspace.of(configuration(safety={"tension_limit": 1.2})),
    "strong lines": Workspace.of(configuration(safety={"tension_limit": 20.0})),
    "short lines": Workspace.of(Config(), ((0.3, 1.0), (0.9, 1.5), (0.8, 1.6))),
    "low": Workspace.of(configuration(geometry={"height": 1.5})),
}


def allowed(workspace: Workspace, u: Floats, h: Floats) -> np.ndarray:
    """Which (u, h) the manual's strokes, the table and the statics of two lines allow."""
    W, b, c = workspace.mechanism.width, np.hypot(u, h), np.hypot(workspace.mechanism.width - u, h)
    inside = (u >= 0.0) & (u <= W) & (h > 0.0) & (h <= workspace.mechanism.reach_down)
    for length, (short, long) in ((b, workspace.line_b), (c, workspace.line_c)):
        inside &= (short <= length) & (length <= long)
    return inside & ((W - u) * b <= workspace.tension_limit * W * h) & (u * c <= workspace.tension_limit * W * h)


@pytest.mark.parametrize("name", MACHINES)
def test_area_and_volume_agree_with_random_places(campaign: Campaign, name: str) -> None:
    workspace = MACHINES[name]
    mechanism = workspace.mechanism
    count = campaign.size(ci=400_000, long=4_000_000)
    draw = np.random.default_rng(campaign.rng().getrandbits(64))
    u, h = draw.uniform(0.0, mechanism.width, count), draw.uniform(0.0, mechanism.reach_down, count)
    frame = mechanism.width * mechanism.reach_down
    # Each hit counts once for the area, and by the way that the boom carries it for the volume.
    for found, weight in (
        (workspace.section.area(), np.ones(count)),
        (workspace.volume(), (mechanism.delta + u) * (workspace.boom[1] - workspace.boom[0])),
    ):
        samples = frame * weight * allowed(workspace, u, h)
        assert abs(samples.mean() - found) < 4.0 * samples.std() / sqrt(count)


@pytest.mark.parametrize("name", MACHINES)
def test_area_and_volume_agree_with_a_fine_grid(name: str) -> None:
    workspace = MACHINES[name]
    mechanism, columns = workspace.mechanism, 400_000
    u: Floats = np.linspace(0.0, mechanism.width, columns + 1)[1:] - 0.5 * mechanism.width / columns
    thick = thickness(workspace, u)
    assert thick.mean() * mechanism.width == pytest.approx(workspace.section.area(), rel=1e-6)
    turned = thick * (mechanism.delta + u) * (workspace.boom[1] - workspace.boom[0])
    assert turned.mean() * mechanism.width == pytest.approx(workspace.volume(), rel=1e-6)


def thickness(workspace: Workspace, u: Floats) -> Floats:
    """Allowed range of h at each u, from one formula a limit."""
    W, k = workspace.mechanism.width, workspace.tension_limit

    def circle(radius: float, away: Floats) -> Floats:
        return np.sqrt(np.maximum(radius**2 - away**2, 0.0))

    # T_b ≤ k and T_c ≤ k, solved for h.
    pulls = [u * (W - u) / np.sqrt((k * W) ** 2 - away**2) for away in (u, W - u)]
    tops = [circle(workspace.line_b[0], u), circle(workspace.line_c[0], W - u), *pulls]
    bottoms = [circle(workspace.line_b[1], u), circle(workspace.line_c[1], W - u)]
    high = np.minimum(np.minimum(*bottoms), workspace.mechanism.reach_down)
    return np.maximum(high - np.max(tops, axis=0), 0.0)


def test_a_section_with_a_known_size() -> None:
    # Lines that are never too short and a table far down leave two circles of radius 1 about anchors 1 apart.
    lens = Section(1.0, (1e-9, 1.0), (1e-9, 1.0), 1e9, 2.0)
    # Half a lens (2π/3 − √3/2)/2 has its tips at u = 0 and u = 1, so nothing of it is cut off.
    assert lens.area() == pytest.approx(0.5 * (2.0 * pi / 3.0 - sqrt(3.0) / 2.0), rel=1e-6)
    assert lens.moment(0.5) == pytest.approx(0.0, abs=1e-9)
    assert lens.moment(0.0) == pytest.approx(0.5 * lens.area(), rel=1e-6)


def test_an_inset_takes_a_rim_away() -> None:
    section = WORKSPACE.section
    thin = 1e-4
    assert 0.0 < section.area() - section.shrunk(thin).area() < thin * 8.0


def test_the_area_that_is_documented() -> None:
    assert WORKSPACE.section.area() == pytest.approx(2.7490544, abs=1e-6)
    assert WORKSPACE.volume() == pytest.approx(7.4314872, abs=1e-6)


PLACES = st.tuples(st.floats(-0.5, 2.5), st.floats(-0.5, 2.5))


def spare(section: Section, place: tuple[float, float]) -> float:
    return float(section.spare(np.array([place[0]]), np.array([place[1]]))[0])


@pytest.mark.parametrize("name", MACHINES)
@given(one=PLACES, other=PLACES)
def test_margin_changes_by_no_more_than_the_place(
    name: str, one: tuple[float, float], other: tuple[float, float]
) -> None:
    section = MACHINES[name].section
    assert abs(spare(section, one) - spare(section, other)) <= dist(one, other) + 1e-12


@pytest.mark.parametrize("name", MACHINES)
@given(place=PLACES)
def test_margin_is_positive_exactly_inside_the_section(name: str, place: tuple[float, float]) -> None:
    found = spare(MACHINES[name].section, place)
    if abs(found) > 1e-12:
        inside = allowed(MACHINES[name], np.array([place[0]]), np.array([place[1]]))[0]
        assert inside == (found > 0.0)


def test_margin_worked_by_hand() -> None:
    # In the middle, 1.25 below the anchors: b = c = √(1 + 1.25²), the table 0.9 deeper, the long end of b 0.659 away.
    assert spare(WORKSPACE.section, (1.0, 1.25)) == pytest.approx(2.26 - hypot(1.0, 1.25))
    assert spare(WORKSPACE.section.shrunk(0.1), (1.0, 1.25)) == pytest.approx(2.16 - hypot(1.0, 1.25))
