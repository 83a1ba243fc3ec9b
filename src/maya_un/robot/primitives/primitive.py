"""The base of primitives, and their arguments with units and bounds.

Kinds of arguments: how each is read, written and named in every form of a command.

An interface with its own form (a ROS message, a JSON schema, the parameters of a command line) depends on the kind of
an argument, never on a primitive: a new primitive of a known kind needs no change there.

All interfaces follow from the declaration of a primitive.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum, auto
from reprlib import repr
from typing import TYPE_CHECKING, Any, ClassVar

from dmc41x3.i18n import phrase
from maya_un.errors import InvalidValue
from maya_un.quantities import angle_in, length_in
from maya_un.values import Joints, Point

if TYPE_CHECKING:
    from maya_un.robot.plan_builder import PlanBuilder


class Argument(ABC):
    """A kind of argument. `key` names it in plain data, "" for no argument; a primitive has a field of that name.

    `numbers` are the names of the values that a remote process passes. `nameable` is whether the name of a taught place
    may replace it.
    """

    key: str = ""
    numbers: tuple[str, ...] = ()
    nameable: ClassVar[bool] = False
    phrases: ClassVar[tuple[str, str, str]] = ("", "", "")
    """For help: the name that may replace it, its numbers, their units."""

    def phrase(self, *, names: bool = True, units: bool = False) -> str:
        """Return the accepted values, for help: also `names`, and the `units` of numbers."""
        name, numbers, unit = self.phrases
        return (f"{name} or " if name and names else "") + numbers + (f" {unit}" if unit and units else "")

    @abstractmethod
    def read(self, value: object, grasp_height: float) -> object:
        """Return the value of plain data; a target without z is at `grasp_height` [m]. Raises `InvalidValue`."""

    @abstractmethod
    def plain(self, value: object) -> object:
        """Return a value as plain data, which `read` accepts."""

    @abstractmethod
    def step(self, value: object) -> object:
        """Return a value in the form of a job's step."""

    @abstractmethod
    def words(self, value: object) -> tuple[str, ...]:
        """Return a value as the words of a label."""

    def of_numbers(self, args: Mapping[str, object]) -> object:
        """Return the plain data of the values that a remote process passes; `args` has all `numbers`."""
        return {name: args[name] for name in self.numbers}


@dataclass(frozen=True, slots=True)
class Nothing(Argument):
    """No argument."""

    def read(self, value: object, grasp_height: float) -> object:
        """Return None."""
        del value, grasp_height

    def plain(self, value: object) -> object:
        """Return None."""
        del value

    def step(self, value: object) -> object:
        """Return True: a step without an argument is written `home: true`."""
        del value
        return True

    def words(self, value: object) -> tuple[str, ...]:
        """Return no words."""
        del value
        return ()


@dataclass(frozen=True, slots=True)
class Target(Argument):
    """A place of the gripper [m]. If `grasps`, a command line may omit z: it is the grasp height."""

    grasps: bool = False
    key: str = "target"
    numbers: tuple[str, ...] = ("x", "y", "z")
    nameable: ClassVar[bool] = True
    phrases: ClassVar[tuple[str, str, str]] = ("a taught place", "x, y, z", "[m]")

    def read(self, value: object, grasp_height: float) -> Point:
        """Return a point [m]."""
        return read_point(value, self.key, grasp_height)

    def plain(self, value: object) -> list[float]:
        """Return [x, y, z]."""
        assert isinstance(value, Point)
        return list(value)

    def step(self, value: object) -> list[float]:
        """Return [x, y, z]."""
        return self.plain(value)

    def words(self, value: object) -> tuple[str, ...]:
        """Return x, y and z."""
        return tuple(f"{number:g}" for number in self.plain(value))


@dataclass(frozen=True, slots=True)
class JointTarget(Argument):
    """Joints a, b, c (rad, m, m)."""

    key: str = "joints"
    numbers: tuple[str, ...] = ("a", "b", "c")
    nameable: ClassVar[bool] = True
    phrases: ClassVar[tuple[str, str, str]] = ("a taught pose", "joints a, b, c", "[rad, m, m]")

    def read(self, value: object, grasp_height: float) -> Joints:
        """Return joints (rad, m, m)."""
        del grasp_height
        return read_joints(value, self.key)

    def plain(self, value: object) -> list[float]:
        """Return [a, b, c]."""
        assert isinstance(value, Joints)
        return list(value)

    def step(self, value: object) -> dict[str, float]:
        """Return {"a": …, "b": …, "c": …}."""
        return dict(zip("abc", self.plain(value), strict=True))

    def words(self, value: object) -> tuple[str, ...]:
        """Return a, b and c."""
        return tuple(f"{number:g}" for number in self.plain(value))


@dataclass(frozen=True, slots=True)
class Switch(Argument):
    """One of two states: true is called `on`, false `off`."""

    on: str
    off: str
    key: str
    numbers: tuple[str, ...]

    def read(self, value: object, grasp_height: float) -> bool:
        """Return a boolean."""
        del grasp_height
        if not isinstance(value, bool):
            raise InvalidValue(key=self.key, value=repr(value), reason="it must be true or false")
        return value

    def plain(self, value: object) -> bool:
        """Return a boolean."""
        return bool(value)

    def step(self, value: object) -> str:
        """Return the name of the state."""
        return self.on if value else self.off

    def words(self, value: object) -> tuple[str, ...]:
        """Return the name of the state."""
        return (self.step(value),)

    def of_numbers(self, args: Mapping[str, object]) -> object:
        """Return the only value."""
        return args[self.numbers[0]]


NOTHING = Nothing()
TARGET = Target()
GRASP = Target(grasps=True)
JOINTS = JointTarget()
OPEN = Switch("open", "close", "open", ("open",))


def read_point(value: object, key: str, grasp_height: float) -> Point:
    """Return [x, y, z], [x, y] or {"x": …, "y": …, "z": …} as a point [m]; raises `InvalidValue` naming `key`.

    A coordinate is a number [m] or a text with a unit, like "500 mm".
    """
    if isinstance(value, Mapping):
        numbers = _by_name(value, dict.fromkeys("xyz", length_in), key, optional="z")
    else:
        numbers = _in_order(value, [length_in] * 3, key, phrase("it must be [x, y] or [x, y, z] in metres"), least=2)
    return Point(numbers[0], numbers[1], numbers[2] if len(numbers) > 2 else grasp_height)


def read_joints(value: object, key: str) -> Joints:
    """Return [a, b, c] or {"a": …, "b": …, "c": …} as joints (rad, m, m); raises `InvalidValue` naming `key`.

    A joint is a number [rad or m] or a text with a unit, like "30 deg".
    """
    if isinstance(value, Mapping):
        return Joints(*_by_name(value, _JOINTS, key))
    return Joints(*_in_order(value, [*_JOINTS.values()], key, phrase("it must be [a, b, c] in radians and metres")))


_Reader = Callable[[object, str], float]

_JOINTS: dict[str, _Reader] = {"a": angle_in, "b": length_in, "c": length_in}


def _in_order(value: object, readers: Sequence[_Reader], key: str, reason: str, least: int = 3) -> list[float]:
    if not isinstance(value, Sequence) or isinstance(value, str) or not least <= len(value) <= len(readers):
        raise InvalidValue(key=key, value=repr(value), reason=reason)
    return [read(item, f"{key}.{place}") for place, (item, read) in enumerate(zip(value, readers, strict=False))]


def _by_name(
    value: Mapping[object, object], readers: Mapping[str, _Reader], key: str, optional: str = ""
) -> list[float]:
    for name in value:
        if name not in readers:
            raise InvalidValue(
                key=f"{key}.{name}",
                value=repr(value[name]),
                reason=phrase("it must have {names} only", names=", ".join(readers)),
            )
    for name in readers:
        if name not in value and name not in optional:
            raise InvalidValue(key=f"{key}.{name}", value=None, reason="it must be a number")
    return [read(value[name], f"{key}.{name}") for name, read in readers.items() if name in value]


class PartEffect(Enum):
    """The effect on a part. It determines whether a repetition does harm, and what the gripper holds afterwards."""

    NONE = auto()
    TAKES = auto()
    PUTS = auto()
    SETS_GRIPPER = auto()
    """It opens or closes the gripper, whatever the gripper holds."""


class Primitive(ABC):
    """One primitive. A subclass is a frozen dataclass with at most one field, named as `argument.key`.

    `command` is its name in every interface. `summary` is its help, in which {argument} stands for the accepted values.
    `in_jobs` is whether it may be a step of a job, `travels` whether a share of the speed applies to it.
    """

    __slots__ = ()
    command: ClassVar[str]
    summary: ClassVar[str]
    argument: ClassVar[Argument] = NOTHING
    part: ClassVar[PartEffect] = PartEffect.NONE
    needs_homing: ClassVar[bool] = True
    in_jobs: ClassVar[bool] = True
    travels: ClassVar[bool] = True

    @abstractmethod
    def plan(self, builder: PlanBuilder) -> None:
        """Plan its phases; raises the reason if it cannot be done."""

    @classmethod
    def help(cls, *, names: bool = True, units: bool = False) -> str:
        """Return its help; see `Argument.phrase`."""
        return cls.summary.format(argument=cls.argument.phrase(names=names, units=units))

    @property
    def value(self) -> Any:
        """The value of the argument, None if the primitive has none."""
        return getattr(self, self.argument.key) if self.argument.key else None

    @property
    def words(self) -> str:
        """The primitive and its argument as a label."""
        return " ".join((self.command, *self.argument.words(self.value)))

    @classmethod
    def harmless(cls) -> bool:
        """Return whether doing it twice has the same effect as doing it once."""
        return cls.part not in {PartEffect.TAKES, PartEffect.PUTS}
