"""`maya calibrate collect FILE`: the running robot moves from pose to pose, a person measures, and the file grows."""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import dist
from pathlib import Path
from typing import Any

import numpy as np

from dmc41x3.i18n import marked, phrase, translate
from maya_un.cli import output
from maya_un.cli.client import COMPUTED, ServiceClient
from maya_un.cli.configure import configuration
from maya_un.cli.offline import FINER
from maya_un.cli.progress import chosen
from maya_un.cli.settings import OutputSettings
from maya_un.cli.units import units_of
from maya_un.cli.waiting import follow
from maya_un.client import requests
from maya_un.config import Config, Units
from maya_un.errors import FileUnreadable, InvalidConfig, InvalidValue, NotHomed, PathRefused, Unreachable
from maya_un.kinematics import Floats, Mechanism
from maya_un.kinematics.calibration import FITTED, design
from maya_un.quantities import length
from maya_un.service.calibration.points import (
    Counts,
    PointNotebook,
    deviation,
    holds_rows,
    is_there,
    read,
    require_same_origin,
)
from maya_un.values import Joints, Point

_FREE = tuple(name for name in FITTED if name != "gripper_height")
"""The constants for which poses are chosen; Φ cannot be determined."""

_SAME = 1e-6
"""Tolerance between the service's and this command's joints and points (rad, m)."""

_UNREACHED = {Unreachable.code, PathRefused.code}


class _Quit(Exception):
    """The person has quit."""


class _Failed(Exception):
    """A motion ended with an error; `report` is the job's."""

    def __init__(self, report: Mapping[str, Any]) -> None:
        super().__init__(report["message"])
        self.report = report


def collect(file: str, number: int, settings: OutputSettings) -> int:
    """Fill `file` up to `number` points; return the exit code.

    Raises `ServiceNotRunning`, `NotHomed`, `InvalidConfig` if the running robot has another configuration,
    `FileUnreadable` and `InvalidValue` for a file that cannot be continued, and the errors of a motion.
    """
    config, path = configuration(settings), Path(file)
    client = ServiceClient.find()
    here = _standing(client, config)
    before = _already(path, config)
    notebook = PointNotebook(path, config)
    session = _Session(client, config, notebook, settings)
    poses = _poses(config, before, number - len(before), here)
    code = session.run(poses, len(before), number)
    count = len(before) + session.written
    value = {"path": file, "points": count, "written": session.written}
    output.answer(
        value,
        translate("{count} points in {path}. Next: maya calibrate {path}", settings.language, count=count, path=path),
        settings,
    )
    return code


def _standing(client: ServiceClient, config: Config) -> Joints:
    """Return the current joints; raises `NotHomed`, and `InvalidConfig` if the robot uses other constants."""
    state = client.ask(requests.status())["state"]
    if state["joints"] is None or state["point"] is None:
        raise NotHomed(command=config.homing_command)
    here, place = Joints(*state["joints"]), Point(*state["point"])
    ours = Units.of(config).to_joints(tuple(state["counts"]))
    if dist(ours, here) > _SAME or dist(Mechanism.of(config).fk(ours), place) > _SAME:
        reason = phrase("the running robot has another configuration; restart `maya up` with this one and home")
        raise InvalidConfig(key="scale, geometry", value=phrase("(tables)"), reason=reason)
    return here


def _already(path: Path, config: Config) -> Floats:
    """Return the joints of the points in a file, shape (n, 3); raises `InvalidValue` for a file of another origin."""
    if not is_there(path):
        return np.empty((0, 3))
    try:
        measured = read(path, config)
    except FileUnreadable:
        if path.is_file() and not holds_rows(path.read_text(encoding="utf-8", errors="replace")):
            return np.empty((0, 3))
        raise
    require_same_origin(measured, path, config)
    return measured.observations.counts / np.array(Units.of(config).per_unit)


def _poses(config: Config, before: Floats, number: int, here: Joints) -> list[Joints]:
    """Return the most informative poses in addition to the known points, in the order of travel."""
    grid = design.apart(design.grid(config), before)
    rows = design.information(config, grid, _FREE)
    known = design.information(config, before, _FREE)
    picked = grid[design.chosen(rows, max(0, number), known)]
    return [Joints(*map(float, picked[index])) for index in design.ordered(config, picked, here)]


@dataclass(slots=True)
class _Session:
    """One session: move, prompt, record."""

    client: ServiceClient
    config: Config
    notebook: PointNotebook
    settings: OutputSettings
    written: int = 0

    def run(self, poses: Sequence[Joints], before: int, total: int) -> int:
        """Move to all poses; return the exit code."""
        try:
            for number, pose in enumerate(poses, before + 1):
                self._say(
                    marked("Point {number} of {total}: moving to {joints}."),
                    number=number,
                    total=total,
                    joints=units_of(self.settings).joints(pose, FINER),
                )
                if self._drive(pose):
                    self._measure()
        except _Quit:
            return output.DONE
        except _Failed as failed:
            return output.concluded(failed.report, self.settings)
        except KeyboardInterrupt:
            return output.INTERRUPTED
        return output.DONE

    def _drive(self, pose: Joints) -> bool:
        """Go to a pose, via the middle of the workspace if the direct way leaves it; return whether it was reached."""
        width = self.config.geometry.width
        middle = Joints(pose.a, 0.75 * width, 0.65 * width)
        refusal = ""
        for way in ([pose], [middle, pose]):
            refused = next((reason for reason in map(self._go, way) if reason), "")
            if not refused:
                return True
            refusal = refusal or refused
        self._say(marked("Left out: {reason}"), reason=refusal)
        return False

    def _go(self, joints: Joints) -> str:
        """Go straight to joints; return the reason for a refusal, "" if done. Raises `_Failed`."""
        since = self.client.ask(requests.status())["last_event"]
        try:
            request = requests.task({"command": "move", "joints": list(joints)})
            accepted = self.client.ask(request, timeout=COMPUTED)
        except (Unreachable, PathRefused) as refusal:
            return refusal.text(self.settings.language)
        with chosen(self.settings) as display:
            report, interrupted = follow(self.client, accepted["id"], since, display, self.settings)
        if interrupted:
            raise KeyboardInterrupt
        if report["state"] == "done":
            return ""
        if report["code"] in _UNREACHED:
            return str(report["message"])
        raise _Failed(report)

    def _measure(self) -> None:
        """Prompt for the gripper position until the input is valid, and record it; raises `_Quit`."""
        counts = self._counts()
        expected = Mechanism.of(self.config).fk(Units.of(self.config).to_joints(counts))
        self._say(marked("Measured x y z (in m, or like 812.5mm; s skips, q quits):"))
        while True:
            answer = sys.stdin.readline()
            said = answer.strip().lower()
            if not answer or said in {"q", "quit"}:
                raise _Quit
            if said in {"s", "skip"}:
                return
            try:
                place, off = self._place(said, expected)
            except InvalidValue as wrong:
                self._say(marked("{reason} Enter it again."), reason=wrong.text(self.settings.language))
                continue
            self.notebook.add(counts, place)
            self.written += 1
            self._say(marked("Saved; {off:.1f} mm from the configured position."), off=off * 1e3)
            return

    def _counts(self) -> Counts:
        a, b, c = self.client.ask(requests.status())["state"]["counts"]
        return int(a), int(b), int(c)

    def _place(self, said: str, expected: Point) -> tuple[Point, float]:
        """Return three lengths, and their distance from the expected point [m]; raises `InvalidValue`."""
        words = said.replace(",", " ").split()
        if len(words) != 3:
            raise InvalidValue(
                key="x y z",
                value=repr(said),
                reason=phrase("three lengths are needed, here are {given}", given=len(words)),
            )
        place = Point(*(length(text, axis) for text, axis in zip(words, "xyz", strict=True)))
        return place, deviation(place, expected)

    def _say(self, text: str, **details: object) -> None:
        if not self.settings.json:
            output.say(translate(text, self.settings.language, **details))
