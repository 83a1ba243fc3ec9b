"""`maya plot`: files of pictures, and printed text."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from maya_un.cli.main import main


def test_without_a_name_the_picture_goes_to_the_current_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["plot", "workspace"]) == 0
    assert capsys.readouterr().out == "Picture: maya-workspace.svg\n"
    svg = (tmp_path / "maya-workspace.svg").read_text(encoding="utf-8")
    assert all(title in svg for title in ("From the side", "From above, at z = 0.40 m", "In space"))


def test_point_is_marked_and_printed(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "plan.svg"
    words = ["plot", "workspace", "--view", "plan", "--height", "900mm", "--point", "-0.2", "1.1", "40cm"]
    assert main([*words, "--output", str(file), "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["path"] == str(file)
    assert (told["view"], told["height"]) == ("plan", 0.9)
    assert told["point"] == {"x": -0.2, "y": 1.1, "z": 0.4}
    assert told["nearest"] == pytest.approx({"x": 0.0, "y": 1.1, "z": 0.4}, abs=1e-3)
    svg = file.read_text(encoding="utf-8")
    assert "From above, at z = 0.90 m" in svg
    assert "From the side" not in svg
    assert "target (-0.200, 1.100, 0.400) m" in svg


def test_given_configuration_is_drawn(tmp_path: Path) -> None:
    config, file = tmp_path / "maya.toml", tmp_path / "side.svg"
    config.write_text("[axes.b]\nmaximum = 2.1\n[safety]\ntension_limit = 3.0\n", encoding="utf-8")
    words = ["plot", "workspace", "--view", "section", "--config", str(config), "--output", str(file)]
    assert main(words) == 0
    svg = file.read_text(encoding="utf-8")
    assert "b = 2.100 m" in svg
    assert "limit: 3 × load" in svg


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--output", "x.jpg"], "error 4001: --output"),
        (["--height", "3"], "error 4001: --height"),
        (["--height", "tall"], "error 4001: --height"),
        (["--point", "1", "2"], "error 4008"),
        (["--view", "inside"], "error 4008"),
        (["--output", "/nowhere/x.svg"], "error 5002"),
    ],
)
def test_impossible_plot_is_refused(words: list[str], said: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["plot", "workspace", *words]) == 2
    assert said in capsys.readouterr().err
