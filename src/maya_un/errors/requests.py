"""4xxx: requests, their names and values, and the rights of their callers."""

from __future__ import annotations

from typing import Literal

from dmc41x3.errors import CodedError
from dmc41x3.i18n import Phrase
from maya_un.errors.base import RequestError

JobStateWord = Literal[
    "queued", "held", "running", "paused", "interrupted", "done", "failed", "cancelled", "skipped"
]  # fmt: skip
"""States of a job in a sentence."""

JobAction = Literal[
    "held", "released", "moved", "a reference for `queue move`", "changed", "changed without approval", "done again"
]  # fmt: skip
"""Changes of a job in the sentence of `WrongState`."""

RefusingState = Literal[JobStateWord, "paused within a step"]
"""States of a job in the sentence of `WrongState`."""


class InvalidJob(RequestError, code=4002, en="The job file has an error at {key}: {reason}."):
    """A job file names a wrong key, step or value."""

    key: str | Phrase
    reason: Phrase


class NotFound(RequestError, code=4004, en="There is no {what} {number}."):
    """No object of this kind has this number or name."""

    what: Literal[
        "job",
        "interrupted job",
        "recording",
        "token",
        "zone",
        "twin",
        "stored queue",
        "measured point",
        "open question",
    ]
    number: int | str | Literal["now", "here", "on a real machine", "with `--journal memory`"]


class SpeedOnRealMachine(
    RequestError,
    code=4006,
    en="`--speed` scales the twin's time, but {address} is a real machine. Omit `--speed`.",
):
    """`--speed` scales the twin's time; a real machine has no scaled time."""

    address: str


class NotIdentifiable(
    RequestError,
    code=4009,
    en="The fit cannot determine {what} from these points: {reason}. Remedy: {remedy}.",
):
    """Measured points do not determine some constants separately; names them and what to measure next."""

    what: Phrase
    reason: Phrase
    remedy: Phrase


class NotTaught(
    RequestError,
    code=4010,
    en="There is no {what} with the name {name!r}. Known: {known}. Store one with `maya teach` or `maya teach-pallet`.",
):
    """No pose or pallet with this name has been taught; lists those that have."""

    what: str | Literal["pose", "pallet", "pose or pallet"]
    name: str
    known: str | Literal["none yet"]


class NameTaken(
    RequestError,
    code=4011,
    en="The name {name!r} exists already. Choose another name. To replace what has this name, teach it again with "
    "`--replace`.",
):
    """A pose or pallet with this name exists already."""

    name: str


class KeyReused(
    RequestError,
    code=4012,
    en="The idempotency key {key!r} was used before for another request. Use a new key for a new request.",
):
    """An idempotency key was reused with another request."""

    key: str


class EventsForgotten(
    RequestError,
    code=4013,
    en="Events after {since} were requested, but the oldest stored event is {oldest}. Read the state again, and "
    "continue with event {oldest}.",
):
    """The requested events were dropped; names the oldest event that is available."""

    since: int
    oldest: int


class WrongState(RequestError, code=4014, en="Job {number} is {state}. A job in this state cannot be {action}."):
    """A job in this state does not allow this change."""

    number: int
    state: RefusingState
    action: JobAction


class AnswerNeeded(
    RequestError,
    code=4015,
    en="A person must answer first: {question} Answer with `maya queue recover CHOICE` ({options}).",
):
    """A user must first answer a question that no program can answer."""

    question: Phrase
    options: str | Phrase


class StreamLagging(
    RequestError,
    code=4016,
    en="This client is {behind} events behind, so Maya closed the stream. Connect again, continue from "
    "event {since}, and read faster.",
):
    """A client of the stream reads more slowly than events come."""

    behind: int
    since: int


class DependencyFailed(
    RequestError,
    code=4017,
    en="This job depends on job {number}, which is {state}, so Maya holds it. Release this job to run it "
    "anyway, or cancel it.",
):
    """A job did not succeed, so Maya holds a job that depends on it."""

    number: int
    state: JobStateWord


class InputTimeout(
    RequestError,
    code=4024,
    en="Input {input} was not {level} within {seconds} s. Find out why, then run the job again from this step "
    "with `maya job again`.",
):
    """A job has waited too long for a digital input.

    `input` is its `number`, or "NAME (NUMBER)" if the job names it.
    """

    input: int | str
    number: int | None = None
    level: Literal["on", "off"]
    seconds: float


class InvalidMessage(
    RequestError, code=4018, en="The message {name} is not valid: {reason}. Correct it and send it again."
):
    """A message does not fit its type."""

    name: str | Phrase
    reason: Phrase


class UnknownInterface(RequestError, code=4019, en="There is no {form} {name} in the ROS graph."):
    """No topic, service, action or type has this name."""

    form: Phrase
    name: str


class ServiceFailed(RequestError, code=4020, en="The service {service} failed: {reason}."):
    """A service of the graph failed, or ended before it answered.

    If the reason repeats this error's own message, the message appears once, without its code.
    """

    service: str
    reason: Phrase

    def __init__(self, *, service: str, reason: str) -> None:
        before = f"The service {service} failed: "
        while reason.startswith(before):
            reason = reason.removeprefix(before).removesuffix(f" [{self.code}]")
        CodedError.__init__(self, service=service, reason=reason.rstrip("."))


class JobChanged(
    RequestError,
    code=4022,
    en="Job {number} has changed since you last read it. Read it again: `maya job show {number}`.",
):
    """A job has changed since the client read it."""

    number: int


class RequestLate(
    RequestError,
    code=4023,
    en="This request arrived {seconds} s after it was sent (at most {most}), so it was not carried out. Check the "
    "connection, then try again.",
):
    """A request on the stream that the connection delayed: its sender may no longer expect its effect."""

    seconds: int
    most: int


class NotOverRos(
    RequestError,
    code=4021,
    en="ROS cannot transmit this request: {request}. Run `maya` on the computer where the robot's nodes "
    "run, or use `maya up` instead of the ROS nodes.",
):
    """A request for which the ROS graph has no message."""

    request: Phrase


class TooMuchAsked(
    RequestError,
    code=4030,
    en="Too many computations run at once (at most {most}). Wait until one has ended, then try again.",
):
    """Too many computations run at once, for one caller or for all."""

    most: int | str


class TakesTooLong(
    RequestError,
    code=4031,
    en="This request takes more than {seconds} s of computing. Reduce it: fewer steps, fewer samples, fewer zones.",
):
    """A computation takes longer than is allowed."""

    seconds: float | str


class TooLarge(
    RequestError,
    code=4032,
    en="This request needs more than {most}. Reduce it: fewer steps or fewer samples.",
):
    """A computation needs more memory than is allowed, or its answer is too long."""

    most: str | Phrase


class StepExpired(
    RequestError,
    code=4040,
    en="This step did not begin before its deadline ({deadline}), so the robot does not carry it out. If "
    "you still need it, send it again with a later deadline.",
):
    """A step came, or its turn came, after its deadline."""

    deadline: str | None


class StepOfOtherRobot(
    RequestError,
    code=4041,
    en="This step is for the robot {robot}, and this robot is {name}. Send it to {robot}.",
):
    """A step names another robot."""

    robot: str
    name: str


class StepNotBegun(
    RequestError,
    code=4042,
    en="The robot stopped, or the step before this one failed, so this step did not begin. Check the robot "
    "and the part, then send the step again (with a new id).",
):
    """The robot stopped, or the step before failed, before this step began."""


class StepInterrupted(
    RequestError,
    code=4043,
    en="Step {id} of {robot} was interrupted, because `maya up` of this robot ended. Check the robot and "
    "the part, then decide whether to send the step again (with a new id).",
):
    """The robot's program ended while a step was under way or waited."""

    id: str | None
    robot: str


class StepFailed(
    RequestError,
    code=4044,
    en="Step {id} of {robot} failed ({error_code}): {error} Check the robot, then send the step again (with a new id).",
):
    """A step ended without success, for a reason that has no code here."""

    id: str | None
    robot: str
    error: Phrase
    error_code: str


class InvalidProcess(RequestError, code=4045, en="The process file has an error at {key}: {reason}."):
    """A file does not describe a process for several robots."""

    key: str | Phrase
    reason: Phrase


class ProcessChanged(
    RequestError,
    code=4046,
    en="The process file has changed since {path} was written, so the process cannot continue from it. "
    "Restore the old process file, or start over with --again.",
):
    """The state of a process belongs to another process, or to an earlier form of it."""

    path: object


class DecisionNeeded(
    RequestError,
    code=4047,
    en="Step {step} of {robot} failed ({error_code}): {error} Check the robot and the part, then run the "
    "process again with --retry {step}, --skip {step} or --abort.",
):
    """A step of a process failed, and a user must decide how to continue."""

    step: str
    robot: str
    error_code: str | None
    error: Phrase | None


class ProcessAborted(
    RequestError,
    code=4048,
    en="This process was ended with --abort after {done} of {steps} steps. To run it again from the "
    "beginning, use --again.",
):
    """A user ended a process before all its steps were done."""

    done: int
    steps: int


class StepTakenElsewhere(
    RequestError,
    code=4049,
    en="This step was already accepted, by another robot named {name} or by this robot before it lost its "
    "stored data. Nobody knows whether it was carried out, so this robot refuses it. Check the robots "
    "and the part. If you still need the step, send it again (with a new id).",
):
    """Another robot with the same name accepted a step, or this one did and lost its journal."""

    name: str


class NotSignedIn(
    RequestError,
    code=4101,
    en="Maya did not accept the request: {reason}. Sign in again, or ask an administrator of the robot "
    "for a token (`maya user token`) and put it into $MAYA_TOKEN.",
):
    """A request came without a token, or with an invalid one."""

    reason: Phrase


class NotAllowed(
    RequestError,
    code=4102,
    en="{operation} needs the role {needed}, but {who} has the role {role}. Ask a person with the role "
    "{needed} to do it.",
):
    """The caller's role does not include this operation."""

    who: str
    role: str
    operation: str
    needed: str


class LastAdministrator(
    RequestError,
    code=4107,
    en="{name} is the only administrator. Give another user the role admin first; otherwise nobody can manage users.",
):
    """The only administrator cannot be removed, and cannot lose the role."""

    name: str


class LeaseHeld(
    RequestError,
    code=4103,
    en="{holder} has been driving the robot for {since}. Ask for the lease with `maya lease ask`, or wait. "
    "`maya stop` works for everybody.",
):
    """Another user drives the robot."""

    holder: str
    since: str


class LeaseNeeded(RequestError, code=4104, en="This command needs the control lease. Take it with `maya lease take`."):
    """Only the holder of the control lease may do this, and the lease has no holder."""


class LeaseLost(
    RequestError,
    code=4105,
    en="Your control lease has ended ({reason}). Take it again with `maya lease take`.",
):
    """The presented control lease has ended."""

    reason: Phrase | Literal["expired", "released", "taken", "handed over", "broken"]


class TooManyRequests(
    RequestError,
    code=4106,
    en="Too many requests ({limit} in {seconds} s are allowed). Wait {wait} s.",
):
    """A client sends more requests than allowed."""

    limit: object | Phrase
    seconds: float | str
    wait: float


class CertificateRefused(
    RequestError,
    code=4110,
    en="The client refused the certificate of the service ({reason}). Use the URL that `maya up` printed. "
    "In Python, pass the certificate file of the service as the argument `ca`. `maya doctor` checks the "
    "name and dates of the certificate.",
):
    """The service's certificate is not trusted, or the service does not use TLS; nothing was sent to it."""

    reason: Phrase


class EdgeNotInstalled(
    RequestError,
    code=4051,
    en="No installed package provides the interface {edge}. Install maya_un again with ./run, then try again.",
):
    """`maya up` should start an edge whose entry point is missing, as in an installation of an older version."""

    edge: str


class TerminalReadsOnly(
    RequestError,
    code=4056,
    en="Maya did not send {command!r}: this terminal sends one command at a time, and only commands that read, "
    "such as TP, `KP ?` or `MG _TPA`. To change the controller, end `maya up` and use `maya dmc terminal`.",
):
    """The terminal of a running robot sends only commands that read: others could endanger motion."""

    command: str
