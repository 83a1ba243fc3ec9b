"""The picture of a replay shows both runs and how far apart they are."""

from __future__ import annotations

import numpy as np
import pytest

from maya_un.plots import style
from maya_un.plots.recording import replay_figure

TIME = np.linspace(10.0, 20.0, 11)
BEFORE = np.column_stack((TIME, TIME / 10.0, 3.0 - TIME / 10.0))


def test_every_axis_has_both_runs_and_their_difference() -> None:
    after = BEFORE + np.array([0.0, 0.001, 0.0])
    apart = (after - BEFORE) * np.array([1.0, 1e3, 1e3])
    figure = replay_figure((TIME, BEFORE + 0.5), (TIME, BEFORE), (TIME, after), (TIME, apart), "limit, 2026-11-21")
    panels = figure.axes
    assert [axes.get_ylabel() for axes in panels] == ["a [°]", "a [°]", "b [m]", "b [mm]", "c [m]", "c [mm]"]
    commanded, recorded, replayed = panels[2].get_lines()
    assert commanded.get_ydata() == pytest.approx(BEFORE[:, 1] + 0.5)
    assert recorded.get_ydata() == pytest.approx(BEFORE[:, 1])
    assert replayed.get_ydata() == pytest.approx(BEFORE[:, 1] + 0.001)
    (difference,) = panels[3].get_lines()
    assert difference.get_ydata() == pytest.approx(np.ones(11))
    legend = panels[0].get_legend()
    assert legend is not None
    assert [text.get_text() for text in legend.get_texts()] == ["commanded", "recorded", "replayed"]
    assert b"limit, 2026-11-21" in style.rendered(figure, "svg")


def test_nothing_recorded_is_an_empty_picture() -> None:
    nothing = (np.empty(0), np.empty((0, 3)))
    assert style.rendered(replay_figure(nothing, nothing, nothing, nothing), "svg")
