"""Figures of the workspace as a whole, and how they are written."""

from __future__ import annotations

import re
from pathlib import Path

import matplotlib as mpl
import pytest

from maya_un.config import Config
from maya_un.errors import FileUnwritable, InvalidValue
from maya_un.kinematics import Box, Workspace
from maya_un.plots import style
from maya_un.plots.workspace import WorkspaceView, workspace_figure
from maya_un.values import Point

WORKSPACE = Workspace.of(Config())
TARGET = Point(1.9, 0.9, 0.4)


@pytest.mark.parametrize(
    ("view", "titles"),
    [
        (WorkspaceView.SECTION, ["From the side, boom at 60°"]),
        (WorkspaceView.PLAN, ["From above, at z = 0.40 m"]),
        (WorkspaceView.SPACE, ["In space"]),
        (WorkspaceView.ALL, ["From the side, boom at 60°", "From above, at z = 0.40 m", "In space"]),
    ],
)
def test_view_has_its_titles(view: WorkspaceView, titles: list[str]) -> None:
    figure = workspace_figure(WORKSPACE, 0.4, view)
    assert [axes.get_title(loc="left") for axes in figure.axes] == titles
    assert figure.legends == []


@pytest.mark.parametrize("view", list(WorkspaceView))
def test_a_target_out_of_reach_is_shown_with_the_nearest_place(view: WorkspaceView) -> None:
    figure = workspace_figure(WORKSPACE, 0.4, view, TARGET)
    nearest = WORKSPACE.nearest(TARGET)
    words = [text.get_text() for text in figure.legends[0].get_texts()]
    assert words == [
        "target (1.900, 0.900, 0.400) m",
        f"nearest reachable place ({nearest.x:.3f}, {nearest.y:.3f}, {nearest.z:.3f}) m",
    ]


@pytest.mark.parametrize(
    ("view", "named"), [(WorkspaceView.ALL, True), (WorkspaceView.PLAN, True), (WorkspaceView.SPACE, False)]
)
def test_legend_explains_zones_that_are_cut(view: WorkspaceView, named: bool) -> None:
    workspace = WORKSPACE.with_zones([Box("rack", Point(0.4, 0.9, 0.0), Point(0.8, 1.3, 0.6))])
    zones = ["zone", "where the gripper would be too near to it"] if named else []
    alone, marked = (workspace_figure(workspace, 0.4, view, at).legends for at in (None, Point(0.5, 1.2, 1.0)))
    assert [text.get_text() for legend in alone for text in legend.get_texts()] == zones
    assert [text.get_text() for text in marked[0].get_texts()][1:] == zones


def test_a_target_in_reach_is_one_mark() -> None:
    figure = workspace_figure(WORKSPACE, 0.4, WorkspaceView.SECTION, Point(0.5, 1.2, 0.4))
    words = [text.get_text() for text in figure.legends[0].get_texts()]
    assert words == ["target, reachable (0.500, 1.200, 0.400) m"]
    # atan2(0.5, 1.2) is 22.6°.
    assert figure.axes[0].get_title(loc="left") == "From the side, boom at 23°"


@pytest.mark.parametrize(("view", "across"), [(WorkspaceView.SECTION, 1.4), (WorkspaceView.PLAN, -1.4)])
def test_target_next_to_the_machine_is_inside_the_picture_and_one_far_off_is_not(
    view: WorkspaceView, across: float
) -> None:
    near, far = (workspace_figure(WORKSPACE, 0.4, view, Point(-1.4 * size, 0.0, 0.4)).axes[0] for size in (1, 9))
    plain = workspace_figure(WORKSPACE, 0.4, view).axes[0]
    assert near.get_xlim()[0] < across < near.get_xlim()[1]
    assert far.get_xlim() == plain.get_xlim()


@pytest.mark.parametrize("kind", style.FORMATS)
def test_the_same_picture_is_the_same_file(kind: str) -> None:
    view = WorkspaceView.ALL if kind == "svg" else WorkspaceView.PLAN
    first, second = (style.rendered(workspace_figure(WORKSPACE, 0.4, view, TARGET), kind) for _ in range(2))
    assert first == second


def test_svg_has_its_text_as_text_and_no_date() -> None:
    svg = style.rendered(workspace_figure(WORKSPACE, 0.4, WorkspaceView.PLAN), "svg").decode()
    assert ">axis a</text>" in svg
    assert "DejaVu Sans" in svg
    assert not re.search(r"dc:date|matplotlib v", svg, re.IGNORECASE)


def test_drawing_leaves_the_users_settings_alone() -> None:
    before = dict(mpl.rcParams)
    style.rendered(workspace_figure(WORKSPACE, 0.4, WorkspaceView.SECTION), "png")
    assert dict(mpl.rcParams) == before


def test_the_users_settings_leave_the_picture_alone() -> None:
    plain = style.rendered(workspace_figure(WORKSPACE, 0.4, WorkspaceView.PLAN), "svg")
    with mpl.rc_context({"font.size": 30.0, "axes.facecolor": "black"}):
        assert style.rendered(workspace_figure(WORKSPACE, 0.4, WorkspaceView.PLAN), "svg") == plain


def test_the_ending_says_the_format(tmp_path: Path) -> None:
    figure = workspace_figure(WORKSPACE, 0.4, WorkspaceView.PLAN)
    for name, begins in (("a.svg", b"<?xml"), ("a.PNG", b"\x89PNG"), ("a.pdf", b"%PDF")):
        style.save(figure, tmp_path / name)
        assert (tmp_path / name).read_bytes().startswith(begins)
    with pytest.raises(InvalidValue, match=r"svg, \.png or \.pdf"):
        style.save(figure, tmp_path / "a.jpg")
    with pytest.raises(FileUnwritable):
        style.save(figure, tmp_path / "nowhere" / "a.svg")
