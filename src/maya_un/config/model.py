"""The model: sections, units, ranges, and the constraints between keys."""

from __future__ import annotations

from collections.abc import Mapping
from math import degrees, hypot, pi, tau
from typing import Annotated, Literal, Self

from pydantic import (
    AfterValidator,
    Field,
    TypeAdapter,
    ValidationError,
    ValidationInfo,
    field_validator,
    model_validator,
)

from dmc41x3.address import parse as parse_address
from dmc41x3.i18n import phrase
from maya_un import manual
from maya_un.axes import AXES
from maya_un.config.base import ANGLE, LENGTH, ConfigSection, Contradiction, Metres, flaw
from maya_un.config.beside import CameraConfig, ComsConfig, RecorderConfig, StorageConfig
from maya_un.errors import InvalidRequest
from maya_un.values import Joints

MOST_ZONES = 100
"""Most zones; each one makes the planning of every step longer."""

HALF_TURN = 3.141592654
"""Half a turn, rounded up [rad]. An end of axis a may exceed a turn by this rounding, which `BoomConfig` removes."""

Coordinate = Annotated[float, Field(ge=-10.0, le=10.0), LENGTH]
"""A coordinate in the base frame: a number [m] or a text like "500 mm"."""

Place = Annotated[tuple[Coordinate, Coordinate, Coordinate], Field(strict=False)]
"""x, y, z [m]."""

Name = Annotated[
    str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9_-]{0,39}$", description="unique name of letters, digits, - and _")
]
Margin = Annotated[
    float, Field(ge=0.0, le=1.0, description="clearance around the zone for gripper and part [m]"), LENGTH
]
Lines = Annotated[bool, Field(description="keep the two lines out too, not only the gripper")]


class BoxConfig(ConfigSection):
    """A box with edges along x, y and z."""

    name: Name
    kind: Annotated[Literal["box"], Field(description="box, cylinder or half_space")]
    low: Annotated[Place, Field(description="x, y, z of the corner where all three are smallest [m]")]
    high: Annotated[Place, Field(description="x, y, z of the corner where all three are greatest [m]")]
    margin: Margin = 0.05
    lines: Lines = True

    @model_validator(mode="after")
    def _has_volume(self) -> Self:
        if not all(low < high for low, high in zip(self.low, self.high, strict=True)):
            raise Contradiction("low", self.low, phrase("each of its coordinates must be smaller than that of high"))
        return self


class CylinderConfig(ConfigSection):
    """An upright cylinder."""

    name: Name
    kind: Annotated[Literal["cylinder"], Field(description="box, cylinder or half_space")]
    x: Annotated[Coordinate, Field(description="x of its axis [m]")]
    y: Annotated[Coordinate, Field(description="y of its axis [m]")]
    radius: Annotated[Metres, Field(description="its radius [m]")]
    low: Annotated[Coordinate, Field(description="z of its bottom [m]")]
    high: Annotated[Coordinate, Field(description="z of its top [m]")]
    margin: Margin = 0.05
    lines: Lines = True

    @model_validator(mode="after")
    def _has_volume(self) -> Self:
        if self.low >= self.high:
            raise Contradiction("low", self.low, phrase("it must be smaller than high"))
        return self


class HalfSpaceConfig(ConfigSection):
    """All of one side of a plane."""

    name: Name
    kind: Annotated[Literal["half_space"], Field(description="box, cylinder or half_space")]
    point: Annotated[Place, Field(description="x, y, z of any place on the plane [m]")]
    normal: Annotated[Place, Field(description="vector that points out of the forbidden side, of any length")]
    margin: Margin = 0.05
    lines: Lines = False

    @model_validator(mode="after")
    def _has_direction(self) -> Self:
        if not hypot(*self.normal) > 1e-6:
            raise Contradiction("normal", self.normal, phrase("it must point somewhere"))
        return self


AnyZone = BoxConfig | CylinderConfig | HalfSpaceConfig
"""The configuration of a zone."""

ZoneConfig = Annotated[AnyZone, Field(discriminator="kind")]
"""The same for a model: `kind` selects one of the three."""

KINDS: dict[str, type[AnyZone]] = {"box": BoxConfig, "cylinder": CylinderConfig, "half_space": HalfSpaceConfig}
"""All kinds of zones by name."""

_ADAPTER: TypeAdapter[AnyZone] = TypeAdapter(ZoneConfig)


def parse_zone(keys: Mapping[str, object]) -> AnyZone:
    """Return the zone of plain data; raises `InvalidRequest` with the key and the reason."""
    try:
        return _ADAPTER.validate_python(dict(keys))
    except ValidationError as error:
        found = flaw(error, tuple(KINDS))
        raise InvalidRequest(key=found.key or "zone", reason=found.reason) from error


Register = Annotated[int, Field(ge=0, le=1_073_740_800)]
"""A controller register in counts, counts/s or counts/s²."""

Letter = Literal["A", "B", "C"]


def _controller_address(address: str) -> str:
    parse_address(address)
    return address


Address = Annotated[str, AfterValidator(_controller_address)]
"""HOST, HOST:PORT, or a serial port as PATH or PATH@BAUD."""
ChannelName = Annotated[str, Field(pattern=r"^([A-Za-z][A-Za-z0-9_-]{0,39})?$")]
"""The name of a digital output or input: a letter, then letters, digits, - and _; "" for none."""


class ControllerConfig(ConfigSection):
    """Address of the motion controller, and time limits for it."""

    address: Annotated[
        Address, Field(description="address for `--address real`: HOST, HOST:PORT, or a serial port as PATH[@BAUD]")
    ] = "192.168.1.156"
    timeout: Annotated[float, Field(gt=0.0, le=60.0, description="longest wait for a reply [s]")] = 2.0
    stream_rate: Annotated[float, Field(ge=1.0, le=100.0, description="data records per second [Hz]")] = 20.0
    outputs: Annotated[
        tuple[Annotated[int, Field(ge=1, le=8)], ...],
        Field(
            strict=False, max_length=7, description="digital outputs that primitives and jobs may switch; default: none"
        ),
    ] = ()
    output_names: Annotated[
        tuple[ChannelName, ...],
        Field(strict=False, max_length=8, description='names of outputs 1 to 8 for jobs, in order; "" for no name'),
    ] = ()
    input_names: Annotated[
        tuple[ChannelName, ...],
        Field(strict=False, max_length=8, description='names of inputs 1 to 8 for jobs, in order; "" for no name'),
    ] = ()


class Geometry(ConfigSection):
    """Lengths of the mechanism [m] (manual, figures 7 to 9)."""

    height: Annotated[Metres, Field(description="H, height of the anchors above the table [m]")] = manual.HEIGHT
    length: Annotated[Metres, Field(description="D, distance of anchor c from axis a [m]")] = manual.LENGTH
    delta: Annotated[Metres, Field(description="distance of anchor b from axis a [m]")] = manual.DELTA
    gripper_height: Annotated[
        Metres, Field(description="Phi, height of the meeting point of the lines above the gripper point [m]")
    ] = manual.GRIPPER_HEIGHT

    @property
    def width(self) -> float:
        """W = D - delta, distance between the two anchors [m]."""
        return self.length - self.delta

    @model_validator(mode="after")
    def _possible(self) -> Self:
        if self.delta >= self.length:
            raise Contradiction(
                "delta", self.delta, phrase("it must be smaller than length: anchor b is nearer than anchor c")
            )
        if self.gripper_height >= self.height:
            reason = phrase("it must be smaller than height: the gripper hangs above the table")
            raise Contradiction("gripper_height", self.gripper_height, reason)
        return self


class Scale(ConfigSection):
    """Encoder counts per unit of motion (manual, constants PULSES_PER_M and PULSES_PER_DEG)."""

    pulses_per_metre: Annotated[float, Field(gt=1e3, le=1e9, description="scale of lines b and c [counts/m]")] = 1e6
    pulses_per_degree: Annotated[float, Field(gt=1.0, le=1e6, description="scale of axis a [counts/deg]")] = 371.06


class AxisConfig(ConfigSection):
    """One axis: its letter on the controller, its stroke in the unit of its kind, its registers."""

    letter: Annotated[Letter, Field(description="letter of the axis on the controller")]
    minimum: float
    maximum: float
    speed_counts: Annotated[int, Field(ge=2, le=15_000_000, description="SP, slew speed [counts/s]")]
    acceleration_counts: Annotated[Register, Field(ge=1024, description="AC, acceleration [counts/s2]")]
    deceleration_counts: Annotated[Register, Field(ge=1024, description="DC, deceleration [counts/s2]")]
    stop_deceleration_counts: Annotated[
        Register, Field(ge=1024, description="VD and DC, deceleration of a stop [counts/s2]")
    ]
    limit_deceleration_counts: Annotated[
        Register, Field(ge=1024, description="SD, deceleration at a limit switch [counts/s2]")
    ]
    error_limit_counts: Annotated[
        int, Field(ge=1, le=2_147_483_647, description="ER, limit of the following error [counts]")
    ]
    jerk_counts: Annotated[
        int | None, Field(ge=1024, le=2_147_483_647, description="limit of the jerk [counts/s3]; default: none")
    ] = None
    switches: Annotated[
        Literal["both", "minimum", "maximum", "none"],
        Field(description="ends of the stroke that have a limit switch: both, minimum, maximum or none"),
    ] = "both"

    @property
    def switch_at_minimum(self) -> bool:
        """Whether a limit switch (reverse, on the controller) is at the lower end of the stroke."""
        return self.switches in {"both", "minimum"}

    @property
    def switch_at_maximum(self) -> bool:
        """Whether a limit switch (forward, on the controller) is at the upper end of the stroke."""
        return self.switches in {"both", "maximum"}

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        if self.minimum >= self.maximum:
            raise Contradiction("minimum", self.minimum, phrase("it must be smaller than maximum"))
        if self.stop_deceleration_counts < self.deceleration_counts:
            reason = phrase("it must not be smaller than deceleration_counts")
            raise Contradiction("stop_deceleration_counts", self.stop_deceleration_counts, reason)
        return self


class BoomConfig(AxisConfig):
    """Axis a, which turns the boom."""

    minimum: Annotated[float, Field(ge=-HALF_TURN, le=10.0, description="lower end of the stroke [rad]"), ANGLE]
    maximum: Annotated[float, Field(gt=0.0, le=10.0, description="upper end of the stroke [rad]"), ANGLE]

    @field_validator("minimum")
    @classmethod
    def _not_rounded_down(cls, minimum: float) -> float:
        return max(minimum, -pi)

    @field_validator("maximum")
    @classmethod
    def _not_rounded_up(cls, maximum: float, info: ValidationInfo) -> float:
        largest = min(info.data.get("minimum", 0.0), 0.0) + tau
        return largest if largest < maximum <= largest + 2.0 * (HALF_TURN - pi) else maximum


class LineConfig(AxisConfig):
    """Axis b or c, a line of variable length."""

    minimum: Annotated[float, Field(le=10.0, description="lower end of the stroke [m]"), LENGTH]
    maximum: Annotated[float, Field(gt=0.0, le=10.0, description="upper end of the stroke [m]"), LENGTH]


def _line(letter: Letter, minimum: float, maximum: float) -> LineConfig:
    return LineConfig(
        letter=letter,
        minimum=minimum,
        maximum=maximum,
        speed_counts=45_000,
        acceleration_counts=5_120,
        deceleration_counts=5_120,
        stop_deceleration_counts=51_200,
        limit_deceleration_counts=51_200,
        error_limit_counts=8_000,
    )


def _boom() -> BoomConfig:
    return BoomConfig(
        letter="A",
        minimum=manual.STROKES[0][0],
        maximum=manual.STROKES[0][1],
        speed_counts=1_000,
        acceleration_counts=1_024,
        deceleration_counts=1_024,
        stop_deceleration_counts=10_240,
        limit_deceleration_counts=10_240,
        error_limit_counts=742,
    )


class Axes(ConfigSection):
    """The three axes."""

    a: BoomConfig = Field(default_factory=_boom)
    b: LineConfig = Field(default_factory=lambda: _line("B", *manual.STROKES[1]))
    c: LineConfig = Field(default_factory=lambda: _line("C", *manual.STROKES[2]))

    def __getitem__(self, index: int) -> AxisConfig:
        return (self.a, self.b, self.c)[index]

    @model_validator(mode="after")
    def _distinct(self) -> Self:
        letters = "".join(axis.letter for axis in (self.a, self.b, self.c))
        if sorted(letters) != ["A", "B", "C"]:
            unusual = zip("abc", letters, "ABC", strict=True)
            again = next(name for name, now, usual in unusual if now != usual and letters.count(now) > 1)
            reason = phrase(
                "axes a, b and c have the letters {letters}; give each letter once", letters=", ".join(letters)
            )
            raise Contradiction(f"{again}.letter", self["abc".index(again)].letter, reason)
        for name, line in (("b", self.b), ("c", self.c)):
            if line.minimum < 0.0:
                raise Contradiction(f"{name}.minimum", line.minimum, phrase("a line has a length, 0 or more"))
        if self.a.maximum > tau:
            reason = phrase("it must be an angle in radians, at most 2 pi; this looks like degrees")
            raise Contradiction("a.maximum", self.a.maximum, reason)
        if self.a.maximum > self.a.minimum + tau:
            reason = phrase("the range from minimum to maximum is more than one turn, so a place would have two angles")
            raise Contradiction("a.minimum", self.a.minimum, reason)
        return self


class GripperConfig(ConfigSection):
    """The gripper's output on the controller (manual: CB1 closes, SB1 opens)."""

    output: Annotated[int, Field(ge=1, le=8, description="number of the digital output")] = 1
    closed_by: Annotated[Literal["clear", "set"], Field(description="bit command that closes the gripper")] = "clear"
    settle_time: Annotated[float, Field(ge=0.0, le=10.0, description="wait after each switching [s]")] = 0.5


class WiringConfig(ConfigSection):
    """How the switches are wired: register CN."""

    limit_active_level: Annotated[
        Literal[-1, 1], Field(description="CN n0, level of an active limit switch: -1 low, 1 high")
    ] = -1


class SafetyConfig(ConfigSection):
    """Limits that the manual lacks, but physics requires (errata 1, 5, 6)."""

    tension_limit: Annotated[
        float, Field(gt=1.0, le=20.0, description="limit of the line tension, as a multiple of the load")
    ] = manual.TENSION_LIMIT
    emergency_tension: Annotated[
        float, Field(ge=1.0, le=5.0, description="limit of the tension during a fault, as a multiple of tension_limit")
    ] = 1.2
    self_locking: Annotated[bool, Field(description="true: the drums hold the load while the motors are off")] = True
    off_on_error: Annotated[
        Literal[0, 1] | None,
        Field(description="OE, 1: an error switches the motor off; default: 1 if self_locking, else 0"),
    ] = None
    guard_time: Annotated[
        float,
        Field(
            ge=0.0,
            le=10.0,
            description="the controller stops the axes if the host is silent for this time [s]; 0: never",
        ),
    ] = 0.5

    @property
    def oe(self) -> int:
        """Register OE: 1 switches a motor off on error, after which only a self-locking drum holds the load."""
        return int(self.self_locking) if self.off_on_error is None else self.off_on_error

    @model_validator(mode="after")
    def _holds(self) -> Self:
        if self.off_on_error == 1 and not self.self_locking:
            raise Contradiction("off_on_error", 1, phrase("it would drop the load, because self_locking is false"))
        if 0.0 < self.guard_time < 0.1:
            raise Contradiction(
                "guard_time", self.guard_time, phrase("a host is often silent for so long; take 0.1 or more")
            )
        return self


class HomingConfig(ConfigSection):
    """Speeds and limits of homing (errata, "Homing, in numbers")."""

    speed: Annotated[float, Field(gt=0.0, le=0.2, description="speed of the lines during travel [m/s]")] = 0.03
    slow_speed: Annotated[
        float, Field(gt=0.0, le=0.02, description="speed of the lines during probing and final approach [m/s]")
    ] = 0.002
    torque_per_load: Annotated[float, Field(gt=0.0, le=9.9, description="motor command per load on a line [V]")] = 0.5
    torque_readings: Annotated[
        bool, Field(description="false: the motor commands (TT) do not show the load, so homing cannot use them")
    ] = True
    stroke_tolerance: Annotated[
        float,
        Field(
            ge=0.0,
            le=0.2,
            description="allowed difference between the measured and the configured stroke, as a fraction",
        ),
    ] = 0.03


class CellConfig(ConfigSection):
    """The table under the robot: heights above its top [m] (errata, "The cell")."""

    grasp_height: Annotated[
        Metres, Field(description="height of the gripper point when it grasps a standard part [m]")
    ] = 0.40
    clearance: Annotated[Metres, Field(description="height of the approach point above pick and place [m]")] = 0.10
    smooth: Annotated[bool, Field(description="true: pass the points above pick and place without a stop")] = True


def _millimetres(length: float) -> str:
    """Return a length [m] as people measure it."""
    return f"{length * 1e3:.6g} mm"


NARROWEST = 0.4
"""Least distance of the anchors, W [m]."""

SHORTEST, STROKE = 0.1, 0.25
"""Least length and least stroke of a line, as shares of W."""

DEPTH = 0.35
"""Least way of the gripper down to cell.grasp_height, as a share of W."""

MOST_SLACK = 0.2
"""A line may be slack by this at its long end during homing [m]."""

STATED_WITHIN = Joints(0.035, 0.020, 0.020)
"""Largest error of a person's statement about a pose (rad, m, m)."""

APART = Joints(0.09, 0.05, 0.05)
"""Every axis moves at least this far from the pose of a given datum to its second point (rad, m, m)."""

ROOM = 0.125
"""With one line at its short end and the other at its long one, b + c exceeds W by at least this share of W."""


class Config(ConfigSection):
    """All constants of one machine. Immutable; the defaults are the manual's."""

    controller: ControllerConfig = ControllerConfig()
    geometry: Geometry = Geometry()
    scale: Scale = Scale()
    axes: Axes = Field(default_factory=Axes)
    gripper: GripperConfig = GripperConfig()
    wiring: WiringConfig = WiringConfig()
    safety: SafetyConfig = SafetyConfig()
    homing: HomingConfig = HomingConfig()
    cell: CellConfig = CellConfig()
    recorder: RecorderConfig = RecorderConfig()
    storage: StorageConfig = StorageConfig()
    coms: ComsConfig = ComsConfig()
    camera: CameraConfig = CameraConfig()
    zones: Annotated[
        tuple[ZoneConfig, ...],
        Field(
            strict=False,
            max_length=MOST_ZONES,
            description="keep-out zones, one [[zones]] table each; default: none",
        ),
    ] = ()

    @model_validator(mode="after")
    def _reachable(self) -> Self:
        width, b, c = self.geometry.width, self.axes.b, self.axes.c
        if b.maximum + c.maximum <= width:
            reason = phrase("with axes.c.maximum it must exceed length - delta, or the lines never meet")
            raise Contradiction("axes.b.maximum", b.maximum, reason)
        for name, line in (("b", b), ("c", c)):
            if line.minimum >= width:
                reason = phrase("it must be smaller than length - delta, or nothing is reachable")
                raise Contradiction(f"axes.{name}.minimum", line.minimum, reason)
        return self

    @property
    def person_needed(self) -> str:
        """Why homing needs a person, "" if the robot finds its position alone."""
        if self.axes.a.switches == "none":
            return phrase("axis a has no switch")
        for name, line in (("b", self.axes.b), ("c", self.axes.c)):
            if not line.switch_at_minimum:
                return phrase("line {name} has no switch at its short end", name=name)
        return "" if self.homing.torque_readings else phrase("the motors show no torque")

    @property
    def homing_command(self) -> Literal["maya home", "maya datum"]:
        """The command with which a person begins to make the position known."""
        return "maya datum" if self.person_needed else "maya home"

    @property
    def deepest(self) -> float:
        """The distance of the gripper at cell.grasp_height from its height with straight lines [m]."""
        return self.geometry.height - self.geometry.gripper_height - self.cell.grasp_height

    def longest(self, line: AxisConfig) -> float:
        """Return the greatest length at which the long switch of a line may trip [m]."""
        return line.maximum * (1.0 + self.homing.stroke_tolerance)

    @model_validator(mode="after")
    def _cell_below_anchors(self) -> Self:
        grasp, highest = self.cell.grasp_height, self.geometry.height - self.geometry.gripper_height
        if grasp + self.cell.clearance >= highest:
            reason = phrase(
                "with the clearance it must stay below {highest}, where the lines are straight",
                highest=_millimetres(highest),
            )
            raise Contradiction("cell.grasp_height", grasp, reason)
        return self

    @model_validator(mode="after")
    def _can_home(self) -> Self:
        """Require what homing needs: docs/explanation/homing.md derives each condition."""
        if self.person_needed:
            return self._can_be_given_a_datum()
        width, shortest = self.geometry.width, 1.0 - self.homing.stroke_tolerance
        if width < NARROWEST:
            reason = phrase("length - delta must be {least} or more for homing", least=_millimetres(NARROWEST))
            raise Contradiction("geometry.length", self.geometry.length, reason)
        for name, line, other in (("b", self.axes.b, self.axes.c), ("c", self.axes.c, self.axes.b)):
            if line.minimum < SHORTEST * width:
                shortest_line = _millimetres(SHORTEST * width)
                reason = phrase("homing needs {least} or more, a tenth of length - delta", least=shortest_line)
                raise Contradiction(f"axes.{name}.minimum", line.minimum, reason)
            if line.maximum - line.minimum < STROKE * width:
                reason = phrase("homing needs a stroke of {least} or more", least=_millimetres(STROKE * width))
                raise Contradiction(f"axes.{name}.maximum", line.maximum, reason)
            if line.minimum + other.maximum * shortest < width * (1.0 + ROOM):
                reason = phrase(
                    "with the maximum of the other line it must be {least} or more: otherwise both lines are "
                    "straight before this one is at its short end",
                    least=_millimetres(width * (1.0 + ROOM)),
                )
                raise Contradiction(f"axes.{name}.minimum", line.minimum, reason)
            beside = min(self.deepest, other.maximum - 0.025 * width)
            if self.longest(line) - MOST_SLACK > hypot(width, beside):
                reason = phrase(
                    "it is too long for the height: at its long end, this line is slack or the gripper is below "
                    "cell.grasp_height"
                )
                raise Contradiction(f"axes.{name}.maximum", line.maximum, reason)
        if self.deepest < DEPTH * width:
            reason = phrase(
                "homing needs {least} between the gripper at the anchors and cell.grasp_height",
                least=_millimetres(DEPTH * width),
            )
            raise Contradiction("geometry.height", self.geometry.height, reason)
        return self

    def _can_be_given_a_datum(self) -> Self:
        """Require a second point, away from the first one and from the ends of the stroke."""
        for name, within, apart in zip(AXES, STATED_WITHIN, APART, strict=True):
            axis: BoomConfig | LineConfig = getattr(self.axes, name)
            least = 2.0 * within + apart
            if axis.maximum - axis.minimum < least:
                shown = f"{degrees(least):.1f}°" if name == "a" else _millimetres(least)
                reason = phrase("to be given a datum, the axis needs a stroke of {least} or more", least=shown)
                raise Contradiction(f"axes.{name}.maximum", axis.maximum, reason)
        return self

    @model_validator(mode="after")
    def _outputs_are_different(self) -> Self:
        if len(set(self.controller.outputs)) < len(self.controller.outputs):
            raise Contradiction("controller.outputs", list(self.controller.outputs), phrase("an output is named twice"))
        if self.gripper.output in self.controller.outputs:
            raise Contradiction("controller.outputs", self.gripper.output, phrase("it is the output of the gripper"))
        return self

    @model_validator(mode="after")
    def _channels_have_names_of_their_own(self) -> Self:
        for key in ("output_names", "input_names"):
            names = [name for name in getattr(self.controller, key) if name]
            if len(set(names)) < len(names):
                twice = next(name for name in names if names.count(name) > 1)
                raise Contradiction(f"controller.{key}", names, phrase("the name {name} appears twice", name=twice))
        return self

    @model_validator(mode="after")
    def _zones_have_names_of_their_own(self) -> Self:
        names: set[str] = set()
        for number, zone in enumerate(self.zones):
            if zone.name in names:
                raise Contradiction(f"zones.{number}.name", zone.name, phrase("another zone has this name"))
            names.add(zone.name)
        return self
