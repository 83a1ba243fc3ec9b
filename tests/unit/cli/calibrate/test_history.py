from __future__ import annotations

import json
import signal
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from pathlib import Path

import pytest

from maya_un.cli.calibrate import history
from maya_un.cli.calibrate.history import HistoryStep, in_force, steps
from maya_un.config import load
from maya_un.errors import FileUnreadable, FileUnwritable, InvalidConfig, NothingToRevert

MINE = "# ours\n[geometry]\nheight = 2.34  # from the drawing\n\n[axes.b]\nspeed_counts = 40_000\n"
KEYS = {"geometry.height": 2.36, "geometry.delta": 0.31, "axes.b.minimum": 0.58}


def about(digest: str = "d1") -> HistoryStep:
    return HistoryStep(
        number=0,
        action="applied",
        date="2026-03-01T10:00:00+00:00",
        author="ana",
        points="points.csv",
        digest=digest,
        measured=30,
        used=28,
        rms_before=0.02,
        rms_after=0.001,
        before={},
        after={},
    )


@pytest.fixture
def config(tmp_path: Path) -> Path:
    file = tmp_path / "maya.toml"
    file.write_text(MINE)
    return file


def values(file: Path) -> tuple[float, float, float]:
    found = load(file)
    return found.geometry.height, found.geometry.delta, found.axes.b.minimum


def test_applying_changes_the_file_and_keeps_handwritten_text(config: Path) -> None:
    step = history.apply(config, KEYS, about())
    assert values(config) == (2.36, 0.31, 0.58)
    assert "# ours" in config.read_text()
    assert "# from the drawing" in config.read_text()
    assert load(config).axes.b.speed_counts == 40_000
    assert step.before == {"geometry.height": 2.34, "geometry.delta": None, "axes.b.minimum": None}
    assert step.after == KEYS


def test_step_is_stored_with_user_time_and_origin(config: Path) -> None:
    history.apply(config, KEYS, about())
    (kept,) = steps(config)
    assert kept == about().model_copy(update={"number": 1, "before": kept.before, "after": KEYS})
    assert (config.parent / "maya.calibrations" / "0001.json").exists()


def test_reverting_gives_the_values_back(config: Path) -> None:
    history.apply(config, KEYS, about())
    step = history.revert(config, "2026-03-02T10:00:00+00:00", "ben")
    assert values(config) == (2.34, 0.3, 0.575)
    assert (step.number, step.action, step.reverts, step.author) == (2, "reverted", 1, "ben")


def test_calibrations_are_taken_back_one_by_one(config: Path) -> None:
    history.apply(config, KEYS, about("d1"))
    history.apply(config, {"geometry.height": 2.37}, about("d2"))
    history.apply(config, {"geometry.height": 2.38}, about("d3"))
    heights = [load(config).geometry.height]
    for _ in range(2):
        history.revert(config, "later", "ben")
        heights.append(load(config).geometry.height)
    assert heights == [2.38, 2.37, 2.36]
    assert [step.digest for step in in_force(steps(config))] == ["d1"]
    history.apply(config, {"geometry.height": 2.39}, about("d4"))
    history.revert(config, "later", "ben")
    history.revert(config, "later", "ben")
    assert values(config) == (2.34, 0.3, 0.575)
    with pytest.raises(NothingToRevert, match="none is in force"):
        history.revert(config, "later", "ben")


def test_value_changed_since_is_not_reverted(config: Path) -> None:
    history.apply(config, KEYS, about())
    changed = config.read_text().replace("2.36", "2.35")
    config.write_text(changed)
    with pytest.raises(NothingToRevert, match=r"geometry\.height was changed"):
        history.revert(config, "later", "ben")
    assert config.read_text() == changed
    assert len(steps(config)) == 1


def test_a_file_that_was_not_there_is_made(tmp_path: Path) -> None:
    file = tmp_path / "maya" / "config.toml"
    history.apply(file, KEYS, about())
    assert values(file) == (2.36, 0.31, 0.58)
    history.revert(file, "later", "ben")
    assert values(file) == (2.35, 0.3, 0.575)


@pytest.mark.parametrize(
    "keys",
    [
        {"geometry.delta": 2.5},
        {"axes.b.minimum": 2.3},
        {"geometry.height": 99.0},
        {"geometry.height": 1.0, "axes.b.minimum": 1.9, "axes.c.minimum": 1.9},
    ],
    ids=["beyond anchor c", "longer than its maximum", "not metres", "nothing reachable"],
)
def test_values_that_make_no_machine_are_refused_and_nothing_is_written(config: Path, keys: dict[str, float]) -> None:
    with pytest.raises(InvalidConfig):
        history.apply(config, keys, about())
    assert config.read_text() == MINE
    assert steps(config) == []


def test_invalid_toml_is_refused(config: Path) -> None:
    config.write_text("[geometry\n")
    with pytest.raises(FileUnreadable):
        history.apply(config, KEYS, about())


def test_unwritable_step_leaves_the_configuration(config: Path) -> None:
    history.folder(config).write_text("in the way")
    with pytest.raises(FileUnwritable):
        history.apply(config, KEYS, about())
    assert config.read_text() == MINE


KILLED = """
import os, signal, sys
from pathlib import Path
from maya_un.cli.calibrate import history

def kill_at(number, does):
    def counted(*args):
        kill_at.calls += 1
        if kill_at.calls == number:
            os.kill(os.getpid(), signal.SIGKILL)
        return does(*args)
    return counted

kill_at.calls = 0
file, number, request = Path(sys.argv[1]), int(sys.argv[2]), sys.argv[3]
history.replace = kill_at(number, history.replace)
history._settle = kill_at(number, history._settle)
if request == "revert":
    history.revert(file, "later", "ben")
else:
    history.apply(file, {"geometry.height": 2.37}, history.HistoryStep.model_validate_json(request))
"""
"""Applies or reverts, and is killed before one of: settling, writing the step, writing the file, numbering the step."""


def killed(config: Path, before: int, request: str) -> None:
    done = subprocess.run([sys.executable, "-c", KILLED, config, str(before), request], check=False)
    assert done.returncode == -signal.SIGKILL


@pytest.mark.parametrize(("before", "applied"), [(2, False), (3, False), (4, True)])
def test_an_applying_that_was_killed_was_done_or_never_was(config: Path, before: int, applied: bool) -> None:
    history.apply(config, KEYS, about("d1"))
    killed(config, before, about("d2").model_dump_json())
    assert load(config).geometry.height == (2.37 if applied else 2.36)
    assert [step.digest for step in in_force(steps(config))] == ["d1", "d2"][: 1 + applied]
    assert (history.before(config, "d2") is not None) is applied
    heights = [history.revert(config, "later", "ben").after["geometry.height"] for _ in range(1 + applied)]
    assert heights == [2.36, 2.34][-1 - applied :]
    assert [step.number for step in steps(config)] == list(range(1, 3 + 2 * applied))


@pytest.mark.parametrize(("before", "reverted"), [(2, False), (3, False), (4, True)])
def test_a_reverting_that_was_killed_was_done_or_never_was(config: Path, before: int, reverted: bool) -> None:
    history.apply(config, KEYS, about("d1"))
    killed(config, before, "revert")
    assert load(config).geometry.height == (2.34 if reverted else 2.36)
    assert len(in_force(steps(config))) == 1 - reverted
    if not reverted:
        assert history.revert(config, "later", "ben").number == 2
    with pytest.raises(NothingToRevert, match="none is in force"):
        history.revert(config, "later", "ben")
    assert [path.name for path in sorted(history.folder(config).iterdir())] == ["0001.json", "0002.json"]


@pytest.mark.parametrize(
    "content",
    ["", "{}", "[]", '{"number": "one"}', "null", "\x00"],
    ids=["empty", "bare", "list", "kind", "null", "nul"],
)
def test_a_damaged_step_is_named(config: Path, content: str) -> None:
    history.apply(config, KEYS, about())
    damaged = history.folder(config) / "0001.json"
    damaged.write_text(content)
    with pytest.raises(FileUnreadable, match=r"0001\.json"):
        steps(config)


def test_a_step_with_a_key_too_many_is_damaged(config: Path) -> None:
    history.apply(config, KEYS, about())
    damaged = history.folder(config) / "0001.json"
    damaged.write_text(json.dumps(json.loads(damaged.read_text()) | {"more": 1}))
    with pytest.raises(FileUnreadable):
        steps(config)


def test_the_configuration_before_a_calibration_is_found_by_its_points(config: Path) -> None:
    history.apply(config, KEYS, about("d1"))
    history.apply(config, {"geometry.height": 2.37, "axes.b.minimum": 0.59}, about("d2"))
    first, second = history.before(config, "d1"), history.before(config, "d2")
    assert first is not None
    assert second is not None
    assert (first.geometry.height, first.axes.b.minimum) == (2.34, 0.575)
    assert (second.geometry.height, second.axes.b.minimum) == (2.36, 0.58)
    assert history.before(config, "d3") is None
    history.revert(config, "later", "ben")
    assert history.before(config, "d2") is None


def test_simultaneous_applies_lose_no_step(config: Path) -> None:
    def applied(number: int) -> int:
        with suppress(FileUnwritable):
            return history.apply(config, {"geometry.height": 2.35 + number * 1e-4}, about(f"d{number}")).number
        return 0

    with ThreadPoolExecutor(8) as others:
        numbers = sorted(number for number in others.map(applied, range(40)) if number)
    assert numbers == list(range(1, len(numbers) + 1))
    assert [step.number for step in steps(config)] == numbers
    assert load(config).geometry.height == steps(config)[-1].after["geometry.height"]


def test_step_whose_configuration_cannot_be_written_is_not_stored(config: Path, tmp_path: Path) -> None:
    (tmp_path / ".maya.toml.new").mkdir()
    with pytest.raises(FileUnwritable):
        history.apply(config, KEYS, about())
    assert steps(config) == []
    assert config.read_text() == MINE


def test_value_that_is_no_longer_a_number_counts_as_changed(config: Path) -> None:
    history.apply(config, KEYS, about())
    config.write_text(config.read_text().replace("2.36", "'high'"))
    with pytest.raises(NothingToRevert, match=r"geometry\.height was changed"):
        history.revert(config, "2026-03-02T10:00:00+00:00", "ben")


@pytest.mark.parametrize("place", [".", "/", "x" * 300])
def test_missing_file_has_no_history(place: str) -> None:
    with pytest.raises(FileUnreadable):
        steps(Path(place))
    with pytest.raises((FileUnreadable, FileUnwritable)):
        history.revert(Path(place), "2026-03-02T10:00:00+00:00", "ben")
