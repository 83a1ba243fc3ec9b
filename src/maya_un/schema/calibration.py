"""The points of a calibration and the result of a fit, as messages. Units are m, rad and encoder counts."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

from pydantic import ConfigDict, Field

from maya_un.schema.bodies import Coordinate
from maya_un.values import Joints, Point

_ONLY_THESE = ConfigDict(extra="forbid")


@dataclass(frozen=True, slots=True)
class CalibrationPoint:
    """A measured point: its `row`, the line of the file; `counts` of a, b, c, and the `joints` by the configuration.

    `measured` and `expected` are the gripper points [m] by measurement and by the configuration, `off` their distance.
    """

    row: int
    counts: tuple[float, float, float]
    joints: Joints
    measured: Point
    expected: Point
    off: float


@dataclass(frozen=True, slots=True)
class FittedConstant:
    """A constant before and after a fit; `error` is one standard error, None for a `held` one.

    Lengths and the zeros of b and c are in m, the zero of a in rad, scales in counts/m and counts/°.
    """

    name: str
    now: float
    fitted: float
    error: float | None
    held: bool


@dataclass(frozen=True, slots=True)
class PointResidual:
    """Model less measured [m] at the point in `row`, before and after a fit; the fit leaves out a point not `used`."""

    row: int
    before: Point
    after: Point
    used: bool


@dataclass(frozen=True, slots=True)
class LineDifferenceView:
    """Relative difference of the counts per metre of line b from those of line c, and its standard error."""

    value: float
    error: float


@dataclass(frozen=True, slots=True)
class CalibrationFit:
    """The result of a fit.

    `correlations` are those of the fitted constants, in their order. `noise` is the standard deviation of a coordinate
    [m], or in sigmas if the points have them. `rms_before` and `rms_after` are the root mean square errors [m] of the
    `used` of the `measured` points; `outliers` are the rows of the others. `words` are sentences to read before the
    result is used. `keys` are the keys of the configuration that change, and `toml` is the same as a file.
    """

    constants: tuple[FittedConstant, ...]
    correlations: tuple[tuple[float, ...], ...]
    noise: float
    rms_before: float
    rms_after: float
    measured: int
    used: int
    outliers: tuple[int, ...]
    line_difference: LineDifferenceView | None
    words: tuple[str, ...]
    residuals: tuple[PointResidual, ...]
    keys: dict[str, float]
    toml: str


@dataclass(frozen=True, slots=True)
class CalibrationView:
    """The measured points in the file at `path`, and the last `fit` to exactly these points, None without one.

    Points can be added while it is `extendable`: while it is empty, or measured with the present configuration.
    """

    path: str
    points: tuple[CalibrationPoint, ...]
    extendable: bool
    fit: CalibrationFit | None


@dataclass(frozen=True, slots=True)
class MeasuredPoint:
    """The gripper point [x, y, z] [m] that a person has measured at the present position."""

    __pydantic_config__: ClassVar[ConfigDict] = _ONLY_THESE
    point: tuple[Coordinate, Coordinate, Coordinate]


@dataclass(frozen=True, slots=True)
class FitRequest:
    """The constants that a fit keeps: height, length, delta, gripper_height, ..., zero_c."""

    __pydantic_config__: ClassVar[ConfigDict] = _ONLY_THESE
    hold: Annotated[list[str], Field(max_length=16)] | None = None
