"""4xxx: what is asked, by whom, and what it is called."""

from __future__ import annotations

from maya_un.errors.base import RequestError


class InvalidJob(RequestError):
    """A job file names a wrong key, step or value."""

    code = 4002


class NotFound(RequestError):
    """No task or job has this number."""

    code = 4004


class SpeedOnRealMachine(RequestError):
    """`--speed` scales the twin's time; a real machine has no such thing."""

    code = 4006


class NotIdentifiable(RequestError):
    """Measured points cannot tell constants of the machine apart; names them and what to measure next."""

    code = 4009


class NotTaught(RequestError):
    """No pose or pallet has been taught under this name; lists those that have."""

    code = 4010


class NameTaken(RequestError):
    """Something is taught under this name already."""

    code = 4011


class KeyReused(RequestError):
    """An idempotency key came again with another request."""

    code = 4012


class EventsForgotten(RequestError):
    """Events were asked for that are not kept any more; names the oldest that is."""

    code = 4013


class WrongState(RequestError):
    """A job cannot be changed like that in the state it is in."""

    code = 4014


class AnswerNeeded(RequestError):
    """A person has to say something first that nobody else can know."""

    code = 4015


class StreamLagging(RequestError):
    """A reader of the stream does not keep up with the events."""

    code = 4016


class DependencyFailed(RequestError):
    """A job that another depends on ended otherwise than done, so the other is held."""

    code = 4017


class InvalidMessage(RequestError):
    """A message does not fit its type."""

    code = 4018


class UnknownInterface(RequestError):
    """No topic, service, action or type of this name."""

    code = 4019


class ServiceFailed(RequestError):
    """A service of the graph failed, or ended before it answered.

    If the reason repeats this error's own message, the message appears once, without its code.
    """

    code = 4020

    def __init__(self, *, service: str, reason: str) -> None:
        before = f"The service {service} failed: "
        while reason.startswith(before):
            reason = reason.removeprefix(before).removesuffix(f" [{self.code}]")
        super().__init__(service=service, reason=reason.rstrip("."))


class JobChanged(RequestError):
    """A job is another than the one that was looked at."""

    code = 4022


class NotOverRos(RequestError):
    """A request for which the ROS graph has no message."""

    code = 4021


class TooMuchAsked(RequestError):
    """Too many computations run at once, for one caller or for all."""

    code = 4030


class TakesTooLong(RequestError):
    """A computation takes longer than is allowed."""

    code = 4031


class TooLarge(RequestError):
    """A computation needs more memory than is allowed, or its answer is too long."""

    code = 4032


class StepExpired(RequestError):
    """A step came, or its turn came, after its deadline."""

    code = 4040


class StepOfOtherRobot(RequestError):
    """A step names another robot."""

    code = 4041


class StepNotBegun(RequestError):
    """The robot stopped, or the step before failed, before this step began."""

    code = 4042


class StepInterrupted(RequestError):
    """The robot's program ended while a step was under way or waited."""

    code = 4043


class StepFailed(RequestError):
    """A step ended without success, for a reason that has no code here."""

    code = 4044


class InvalidProcess(RequestError):
    """A file does not describe a process for several robots."""

    code = 4045


class ProcessChanged(RequestError):
    """The state of a process belongs to another process, or to an earlier form of it."""

    code = 4046


class DecisionNeeded(RequestError):
    """A step of a process failed, and a person decides what becomes of it."""

    code = 4047


class ProcessAborted(RequestError):
    """A person ended a process before all its steps were done."""

    code = 4048


class StepTakenElsewhere(RequestError):
    """Another robot with the same name took a step, or this one did and lost its journal."""

    code = 4049


class NotSignedIn(RequestError):
    """A request came without a token, or with one that is not valid."""

    code = 4101


class NotAllowed(RequestError):
    """The role of whoever asks does not include this."""

    code = 4102


class LeaseHeld(RequestError):
    """Somebody else drives the robot."""

    code = 4103


class LeaseNeeded(RequestError):
    """Only who holds the control lease may do this, and nobody does."""

    code = 4104


class LeaseLost(RequestError):
    """The control lease that was shown has ended."""

    code = 4105


class TooManyRequests(RequestError):
    """A client asks more often than it may."""

    code = 4106


class CertificateRefused(RequestError):
    """The service's certificate is not trusted, or the service speaks no TLS: nothing was sent to it."""

    code = 4110
