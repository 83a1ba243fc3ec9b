"""The bodies of requests, and answers that only acknowledge them: frozen dataclasses in SI units without extra keys."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar, Literal

from pydantic import AfterValidator, ConfigDict, Field, Strict, WithJsonSchema

from dmc41x3.i18n import LANGUAGES, phrase
from maya_un.axes import JOG_AXES
from maya_un.schema.choices import PauseTime, QueueEnd, RecoveryChoice, RoleName
from maya_un.schema.people import LONGEST, PATIENCE
from maya_un.values import FARTHEST, LEAST_OVERRIDE, LEAST_SPEED

_ONLY_THESE = ConfigDict(extra="forbid")


Axis = Annotated[str, WithJsonSchema({"enum": list(JOG_AXES)})]
"""The known axes are checked when the body is used."""


Share = Annotated[float, Field(ge=LEAST_SPEED, le=1.0, description="share of the full speed")]


Distance = Annotated[float, Field(ge=-FARTHEST, le=FARTHEST, description="rad or m", allow_inf_nan=False)]


Component = Annotated[float, Field(ge=-1.0, le=1.0, allow_inf_nan=False, description="share of the full speed")]


Coordinate = Annotated[float, Field(ge=-FARTHEST, le=FARTHEST, description="m", allow_inf_nan=False)]


Password = Annotated[str, Field(max_length=256, json_schema_extra={"format": "password"})]


def _one_way(direction: int) -> int:
    if direction not in {1, -1}:
        raise ValueError(phrase("it must be 1 or -1"))
    return direction


Direction = Annotated[int, Strict(), AfterValidator(_one_way), WithJsonSchema({"enum": [1, -1]})]


def _known(language: str) -> str:
    if language not in LANGUAGES:
        raise ValueError(phrase("it must be one of {choices}", choices=", ".join(LANGUAGES)))
    return language


Language = Annotated[str, AfterValidator(_known), WithJsonSchema({"enum": list(LANGUAGES)})]


Yes = Annotated[bool, Strict(), WithJsonSchema({"const": True})]


No = Annotated[bool, Strict(), WithJsonSchema({"const": False})]
"""A strict bool, because `Literal[True]` would also accept 1."""


Press = Annotated[str, Field(min_length=1, max_length=64)]
"""The id of one press of a key, unique among all clients."""


@dataclass(frozen=True, slots=True)
class JogBy:
    """Jog along one axis by a distance [rad or m]; with `clip`, only as far as the workspace allows."""

    __pydantic_config__: ClassVar[ConfigDict] = _ONLY_THESE
    axis: Axis
    distance: Distance
    speed: Share = 1.0
    clip: bool = True


@dataclass(frozen=True, slots=True)
class StatedPose:
    """The joints in which a person sees the robot (rad, m, m)."""

    __pydantic_config__: ClassVar[ConfigDict] = _ONLY_THESE
    joints: tuple[Distance, Distance, Distance]


@dataclass(frozen=True, slots=True)
class GuardedMove:
    """A slow move of one axis by a distance [rad or m], before homing."""

    __pydantic_config__: ClassVar[ConfigDict] = _ONLY_THESE
    axis: Literal["a", "b", "c"]
    distance: Distance


@dataclass(frozen=True, slots=True)
class JogHold:
    """Jog along one axis while this request is repeated at intervals below 0.5 s.

    `press` is an id of your choice for one press of the key: after its end, a request that arrives late moves nothing.
    """

    __pydantic_config__: ClassVar[ConfigDict] = _ONLY_THESE
    axis: Axis
    direction: Direction
    hold: Yes
    speed: Share = 1.0
    press: Press | None = None


@dataclass(frozen=True, slots=True)
class JogVector:
    """Jog the gripper straight along a vector while this request is repeated at intervals below 0.5 s.

    The length of `vector` [x, y, z], 0.01 to 1, is the share of the full speed, which may change with every request. If
    the direction changes by more than 0.2 rad, the robot first comes to rest on its path. `press` is that of `JogHold`.
    """

    __pydantic_config__: ClassVar[ConfigDict] = _ONLY_THESE
    vector: tuple[Component, Component, Component]
    hold: Yes
    press: Press | None = None


@dataclass(frozen=True, slots=True)
class JogRelease:
    """End the held jog; with `press`, only if this press began it.

    `axis`, `direction`, `speed` and `vector` are accepted and ignored.
    """

    __pydantic_config__: ClassVar[ConfigDict] = _ONLY_THESE
    hold: No
    press: Press | None = None
    axis: Any = None
    direction: Any = None
    speed: Any = None
    vector: Any = None


def kind_of_jog(body: Mapping[str, Any]) -> type:
    """Return the type of a jog request."""
    if "hold" not in body:
        return JogBy
    if body["hold"] is False:
        return JogRelease
    return JogVector if "vector" in body else JogHold


@dataclass(frozen=True, slots=True)
class PlaceToTeach:
    """The `point` of a pose [m]; without it, the pose is the present position of the robot."""

    __pydantic_config__: ClassVar[ConfigDict] = _ONLY_THESE
    point: tuple[Coordinate, Coordinate, Coordinate] | None = None


@dataclass(frozen=True, slots=True)
class Points:
    """Up to 500 points [x, y, z] [m]."""

    __pydantic_config__: ClassVar[ConfigDict] = _ONLY_THESE
    points: Annotated[list[tuple[Coordinate, Coordinate, Coordinate]], Field(max_length=500)]


@dataclass(frozen=True, slots=True)
class Texts:
    """Up to 50 texts of the service, and the language of their translations."""

    __pydantic_config__: ClassVar[ConfigDict] = _ONLY_THESE
    texts: Annotated[list[Annotated[str, Field(max_length=2000)]], Field(max_length=50)]
    language: Language


@dataclass(frozen=True, slots=True)
class ControllerCommand:
    """One command in the controller's language, which only reads."""

    __pydantic_config__: ClassVar[ConfigDict] = _ONLY_THESE
    command: Annotated[str, Field(min_length=1, max_length=80)]


@dataclass(frozen=True, slots=True)
class Speed:
    """The factor on the speed of all motion."""

    __pydantic_config__: ClassVar[ConfigDict] = _ONLY_THESE
    ratio: Annotated[float, Field(ge=LEAST_OVERRIDE, le=1.0)]


@dataclass(frozen=True, slots=True)
class Pausing:
    """When the queue pauses: after the running step, or now, with the step held on its path."""

    __pydantic_config__: ClassVar[ConfigDict] = _ONLY_THESE
    when: PauseTime = "after step"


@dataclass(frozen=True, slots=True)
class Moving:
    """The new position of a job in the queue: one of `before` or `after` another job, or `to` an end."""

    __pydantic_config__: ClassVar[ConfigDict] = _ONLY_THESE
    before: int | None = None
    after: int | None = None
    to: QueueEnd | None = None


@dataclass(frozen=True, slots=True)
class Again:
    """The step from which a job is run again, counted from 1; by default the first unfinished step."""

    __pydantic_config__: ClassVar[ConfigDict] = _ONLY_THESE
    from_step: Annotated[int, Field(ge=1)] | None = None


@dataclass(frozen=True, slots=True)
class Recovering:
    """The decision about an interrupted job, and whether the gripper holds a part if only a person can see it.

    `job` names the interrupted job that was read. So a decision about a job that somebody else has decided is refused,
    and is not taken for the decision about the next one.
    """

    __pydantic_config__: ClassVar[ConfigDict] = _ONLY_THESE
    choice: RecoveryChoice
    holding: bool | None = None
    resume_queue: bool = True
    job: Annotated[int, Field(ge=1)] | None = None


@dataclass(frozen=True, slots=True)
class Answering:
    """The answer to the question of the running job: one of its choices.

    `job` and `index` name the question that was read. So the answer to a question that has closed is refused, and is
    not taken for the answer to the next one.
    """

    __pydantic_config__: ClassVar[ConfigDict] = _ONLY_THESE
    answer: Annotated[str, Field(min_length=1, max_length=30)]
    job: Annotated[int, Field(ge=1)] | None = None
    index: Annotated[int, Field(ge=1)] | None = None


@dataclass(frozen=True, slots=True)
class Taking:
    """Request of the lease: a note, the renewal time `patience` [s], and `force` to take it from its holder."""

    __pydantic_config__: ClassVar[ConfigDict] = _ONLY_THESE
    note: Annotated[str, Field(max_length=200)] = ""
    force: bool = False
    patience: Annotated[float, Field(ge=1.0, le=LONGEST)] = PATIENCE


@dataclass(frozen=True, slots=True)
class Offering:
    """The name of the user to whom the lease is offered."""

    __pydantic_config__: ClassVar[ConfigDict] = _ONLY_THESE
    to: str


@dataclass(frozen=True, slots=True)
class SigningIn:
    """The user who signs in."""

    __pydantic_config__: ClassVar[ConfigDict] = _ONLY_THESE
    name: Annotated[str, Field(max_length=200)]
    password: Password


@dataclass(frozen=True, slots=True)
class UserRequest:
    """A user to be added; without a password, the user signs in by token only."""

    __pydantic_config__: ClassVar[ConfigDict] = _ONLY_THESE
    name: str
    role: RoleName
    password: Password | None = None


@dataclass(frozen=True, slots=True)
class UserChange:
    """Changes of a user; an empty password removes it.

    Users who are not administrators must give the `old` password with a new one.
    """

    __pydantic_config__: ClassVar[ConfigDict] = _ONLY_THESE
    role: RoleName | None = None
    password: Password | None = None
    old: Password = ""


@dataclass(frozen=True, slots=True)
class TokenRequest:
    """Request of a token: its purpose, and its end (a date in UTC; "" for never)."""

    __pydantic_config__: ClassVar[ConfigDict] = _ONLY_THESE
    note: Annotated[str, Field(max_length=200)] = ""
    expires: str = ""


@dataclass(frozen=True, slots=True)
class Name:
    """A new name."""

    __pydantic_config__: ClassVar[ConfigDict] = _ONLY_THESE
    name: str


class Acknowledgement:
    """Base of answers without further content; the methods of the Python client return None for them."""

    __slots__ = ()


@dataclass(frozen=True, slots=True)
class Released(Acknowledgement):
    """The held jog was released."""

    released: Literal[True] = True


@dataclass(frozen=True, slots=True)
class Resumed(Acknowledgement):
    """Motion continues."""

    resumed: Literal[True] = True


@dataclass(frozen=True, slots=True)
class Aborted(Acknowledgement):
    """Motion was aborted."""

    aborted: Literal[True] = True


@dataclass(frozen=True, slots=True)
class Recovered(Acknowledgement):
    """The fault is cleared."""

    recovered: Literal[True] = True


@dataclass(frozen=True, slots=True)
class Forgotten(Acknowledgement):
    """The place of this name is removed."""

    forgotten: str


@dataclass(frozen=True, slots=True)
class Removed(Acknowledgement):
    """The object of this name is removed."""

    removed: str
