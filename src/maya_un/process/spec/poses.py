"""The pose store: taught poses and pallets in a TOML file.

Users may read the file, edit it and put it under version control.

    [poses.rack]
    joints = [0.42, 1.61, 1.3]                  # a [rad], b, c [m]: the taught values
    point = [0.51, 1.12, 0.4]                   # x, y, z [m] when taught; for users, never read
    taught = "2026-11-21T16:02:21+00:00"

    [pallets.tray]
    corners = ["tray.first", "tray.right", [0.3, 1.2]]
    rows = 3
    columns = 4
    taught = "2026-11-21T16:05:00+00:00"

Every lookup reads the file, and parses it if it has changed. Teaching writes the file, as a whole or not at all;
comments in it are then lost.

A name belongs to one pose or to one pallet. On the command line and in a job, a name may replace a place, so it cannot
look like a number or a cell.
"""

from __future__ import annotations

import json
import re
import stat
import tomllib
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Annotated, Any, Self

from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, Field, ValidationError, model_validator

from dmc41x3.files import unreadable
from dmc41x3.i18n import phrase
from maya_un.config.files import alone
from maya_un.config.files import replace as replace_file
from maya_un.errors import FileUnreadable, FileUnwritable, InvalidValue, NameTaken, NotTaught, Unreachable
from maya_un.kinematics.mechanism import Mechanism
from maya_un.process.spec.job import Grid, JointValues, point_of
from maya_un.process.spec.pallet import Pallet
from maya_un.schema.jobs import TaughtPose
from maya_un.validation import reason_of
from maya_un.values import Joints, Point

_NAME = re.compile(r"[^\W\d_][\w.-]{0,63}")


def checked_name(name: object) -> str:
    """Return `name`; raises `InvalidValue` if it is not a valid name."""
    if not isinstance(name, str) or _NAME.fullmatch(name) is None:
        reason = phrase("a name is a letter and up to 63 letters, digits, dots, hyphens and underscores")
        raise InvalidValue(key="name", value=repr(name), reason=reason)
    return name


@dataclass(frozen=True, slots=True)
class TaughtPallet:
    """A grid of places; its corners are points or names of taught poses."""

    name: str
    grid: Grid
    taught: str


@dataclass(frozen=True, slots=True)
class TaughtPlaces:
    """All poses and pallets by their names, in the order of teaching."""

    poses: Mapping[str, TaughtPose] = field(default_factory=dict[str, TaughtPose])
    pallets: Mapping[str, TaughtPallet] = field(default_factory=dict[str, TaughtPallet])

    @property
    def names(self) -> tuple[str, ...]:
        """All names that are taken."""
        return (*self.poses, *self.pallets)

    def pallet(self, name: str, grasp_height: float) -> Pallet:
        """Return the present grid of a taught pallet; a corner without z is at `grasp_height` [m].

        Raises `InvalidValue` if its corners have changed and no longer span a grid.
        """
        return self.spanned(name, self.pallets[name].grid, grasp_height)

    def spanned(self, name: str, grid: Grid, grasp_height: float) -> Pallet:
        """Return the pallet `name` that `grid` describes; raises `InvalidValue` for corners that span none."""
        corners = [self._corner(name, corner, grasp_height) for corner in grid.corners]
        try:
            return Pallet.spanned(corners, grid.rows, grid.columns)
        except ValueError as error:
            raise InvalidValue(key=name, value=phrase("(a grid)"), reason=str(error)) from error

    def _corner(self, pallet: str, corner: str | tuple[float, ...], grasp_height: float) -> Point:
        if not isinstance(corner, str):
            return point_of(corner, grasp_height)
        point = self.poses[corner].point if corner in self.poses else None
        if point is None:
            raise InvalidValue(key=f"{pallet}.corners", value=repr(corner), reason="it is no taught pose with a place")
        return point


MOST_BYTES = 250_000
"""Size of the largest file, some fifteen hundred poses; reading it blocks the robot's loop."""

_HEAD = "# Taught places of Maya: `maya poses` lists them, `maya teach NAME` adds one. Angles in rad, lengths in m.\n"


def _name(text: str) -> str:
    try:
        return checked_name(text)
    except InvalidValue as error:
        raise ValueError(error.details["reason"]) from error


_Name = Annotated[str, AfterValidator(_name)]
_Date = Annotated[str, BeforeValidator(str)]


class _Pose(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")
    joints: JointValues
    point: Any = None
    taught: _Date = ""


class _Pallet(Grid):
    taught: _Date = ""


class _File(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")
    poses: dict[_Name, _Pose] = Field(default_factory=dict)
    pallets: dict[_Name, _Pallet] = Field(default_factory=dict)

    @model_validator(mode="after")
    def _one_meaning(self) -> Self:
        both = sorted(self.poses.keys() & self.pallets.keys())
        if both:
            raise ValueError(phrase("{name!r} is both a pose and a pallet", name=both[0]))
        return self


class PoseStore:
    """Stores taught poses and pallets in the file at `path`, or in memory without a path.

    `mechanism` holds the present constants, by which joints become points. Every method raises `FileUnreadable` for an
    invalid file, and those that change it `FileUnwritable`.
    """

    def __init__(self, mechanism: Mechanism, path: Path | None = None) -> None:
        self._mechanism = mechanism
        self._path = path
        self._text = ""
        self._known: tuple[str, TaughtPlaces] | None = None

    def taught(self) -> TaughtPlaces:
        """Return all taught poses and pallets; an unchanged text is not parsed again."""
        try:
            text = self._read()
            if self._known is None or self._known[0] != text:
                self._known = (text, self._understood(text))
        except (ValueError, RecursionError) as error:
            raise FileUnreadable(path=self._path, reason=_reason(error)) from error
        return self._known[1]

    def _understood(self, text: str) -> TaughtPlaces:
        file = _File.model_validate(tomllib.loads(text))
        poses = {name: self._pose(name, pose) for name, pose in file.poses.items()}
        return TaughtPlaces(poses, {name: _pallet(name, pallet) for name, pallet in file.pallets.items()})

    def teach(self, name: str, joints: Joints, date: str, *, replacing: bool = False) -> TaughtPose:
        """Store `joints` (rad, m, m) under `name`, taught on `date`, and return the pose.

        Raises `InvalidValue` for an invalid name, and `NameTaken`; with `replacing` only for the name of a pallet.
        """
        with self._alone():
            known = self.taught()
            _require_free(name, known, replaced=known.poses if replacing else {})
            pose = self._pose(name, _Pose(joints=joints, taught=date))
            self._write(replace(known, poses={**known.poses, name: pose}))
        return pose

    def teach_pallet(
        self, name: str, grid: Grid, date: str, grasp_height: float, *, replacing: bool = False
    ) -> TaughtPallet:
        """Store a grid under `name`, taught on `date`, and return the pallet.

        Raises `InvalidValue` for an invalid name and for corners that span no grid, and `NameTaken`; with `replacing`
        only for the name of a pose.
        """
        with self._alone():
            known = self.taught()
            _require_free(name, known, replaced=known.pallets if replacing else {})
            known.spanned(name, grid, grasp_height)
            pallet = TaughtPallet(name, grid, date)
            self._write(replace(known, pallets={**known.pallets, name: pallet}))
        return pallet

    def forget(self, name: str) -> None:
        """Remove a pose or a pallet; raises `NotTaught`, and `InvalidValue` for a pose that is a pallet's corner."""
        with self._alone():
            known = self.taught()
            require_known(name, known)
            for pallet in known.pallets.values():
                if pallet.name != name and name in pallet.grid.corners:
                    reason = phrase("it is a corner of the pallet {name}; remove that first", name=pallet.name)
                    raise InvalidValue(key="name", value=name, reason=reason)
            self._write(TaughtPlaces(_without(known.poses, name), _without(known.pallets, name)))

    def rename(self, old: str, new: str) -> None:
        """Rename a pose or a pallet, also in the corners of pallets.

        Raises `NotTaught`, `NameTaken` and `InvalidValue` for an invalid name.
        """
        with self._alone():
            known = self.taught()
            require_known(old, known)
            _require_free(new, known, replaced={})
            poses = {new if name == old else name: pose for name, pose in known.poses.items()}
            pallets = {
                new if name == old else name: replace(pallet, grid=_renamed(pallet.grid, old, new))
                for name, pallet in known.pallets.items()
            }
            self._write(TaughtPlaces(poses, pallets))

    def _pose(self, name: str, pose: _Pose) -> TaughtPose:
        point: Point | None = None
        with suppress(Unreachable):
            point = self._mechanism.fk(pose.joints)
        return TaughtPose(name, pose.joints, point, pose.taught)

    @contextmanager
    def _alone(self) -> Iterator[None]:
        """Prevent other processes from changing the file between its reading and its writing."""
        if self._path is None:
            yield
            return
        with alone(self._path):
            yield

    def _read(self) -> str:
        if self._path is None:
            return self._text
        try:
            found = self._path.stat()
            if not stat.S_ISREG(found.st_mode):  # a pipe would block the loop until a program writes to it
                raise FileUnreadable(path=self._path, reason="it is no file")
            if found.st_size > MOST_BYTES:
                raise FileUnreadable(path=self._path, reason=phrase("it is larger than {most} bytes", most=MOST_BYTES))
            return self._path.read_text(encoding="utf-8")
        except FileNotFoundError:
            return ""
        except OSError as error:
            raise unreadable(self._path, error) from error

    def _write(self, taught: TaughtPlaces) -> None:
        text = to_toml(taught)
        if len(text.encode()) > MOST_BYTES:
            raise FileUnwritable(
                path=self._path, reason=phrase("it would be larger than {most} bytes", most=MOST_BYTES)
            )
        if self._path is None:
            self._text = text
        else:
            replace_file(self._path, text)


def require_known(name: str, known: TaughtPlaces, what: str = "pose or pallet") -> None:
    """Raise `NotTaught` if no pose or pallet has the name `name`."""
    if name not in known.names:
        raise NotTaught(what=what, name=name, known=", ".join(known.names) or "none yet")


def _require_free(name: str, known: TaughtPlaces, replaced: Mapping[str, object]) -> None:
    checked_name(name)
    if name in known.names and name not in replaced:
        raise NameTaken(name=name)


def _pallet(name: str, pallet: _Pallet) -> TaughtPallet:
    return TaughtPallet(name, Grid(corners=pallet.corners, rows=pallet.rows, columns=pallet.columns), pallet.taught)


def _renamed(grid: Grid, old: str, new: str) -> Grid:
    return grid.model_copy(update={"corners": tuple(new if corner == old else corner for corner in grid.corners)})


def _without(entries: Mapping[str, Any], name: str) -> dict[str, Any]:
    return {key: entry for key, entry in entries.items() if key != name}


def to_toml(taught: TaughtPlaces) -> str:
    """Return all poses and pallets as the text of a file."""
    lines = [_HEAD]
    for name, pose in taught.poses.items():
        values = {"joints": list(pose.joints), "point": pose.point and list(pose.point), "taught": pose.taught}
        lines += _table("poses", name, values)
    for name, pallet in taught.pallets.items():
        grid = pallet.grid
        corners = [corner if isinstance(corner, str) else list(corner) for corner in grid.corners]
        values = {"corners": corners, "rows": grid.rows, "columns": grid.columns, "taught": pallet.taught}
        lines += _table("pallets", name, values)
    return "\n".join(lines)


def _table(kind: str, name: str, values: Mapping[str, object]) -> list[str]:
    head = f"[{kind}.{json.dumps(name, ensure_ascii=False)}]"
    said = ((key, value) for key, value in values.items() if value is not None)
    return [head, *(f"{key} = {_toml(value)}" for key, value in said), ""]


def _toml(value: object) -> str:
    """Return a text, a number or a list of them as JSON, with the one letter escaped that TOML forbids."""
    return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")


def _reason(error: Exception) -> str:
    if not isinstance(error, ValidationError):
        return phrase("it is not TOML: {error}", error=error)
    first = error.errors(include_url=False)[0]
    place = ".".join(str(part) for part in first["loc"] if part != "[key]")
    return f"{place}: {reason_of(first)}".removeprefix(": ")
