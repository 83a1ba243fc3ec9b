"""The service behind every interface, and the gate that checks each operation. Units are m, rad, s.

The service raises only errors of `maya_un.errors`; interfaces pass their code and message on unchanged. Interfaces call
it through the gate: every request names its operation, and passes only if role and lease allow it. The audit log
records the request and its outcome.
"""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Awaitable, Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Protocol, TypeVar

import maya_un
from dmc41x3.address import SIM
from dmc41x3.i18n import phrase
from maya_un.cancellation import is_caller_cancelled, run_to_rest
from maya_un.config import Config
from maya_un.config.model import AnyZone
from maya_un.controller.homing import homed_pose
from maya_un.controller.protocol import Controller
from maya_un.errors import (
    Busy,
    Cancelled,
    CommandRejected,
    InternalError,
    LeaseLost,
    MayaError,
    NotAllowed,
    NotFound,
    Stopped,
)
from maya_un.events import Event
from maya_un.motion.move import CoordinatedMove
from maya_un.process.journal.protocol import JobOptions, RequestOwner
from maya_un.process.lease import ControlLease
from maya_un.process.process import Process
from maya_un.process.queue.editing import DEFAULT_OPTIONS, SubmitRequest
from maya_un.process.spec.job import Job
from maya_un.process.spec.poses import PoseStore
from maya_un.recorder.recorder import Recorder
from maya_un.robot.plan_builder import Pose
from maya_un.robot.primitives import Primitive
from maya_un.robot.robot import Robot
from maya_un.schema.jobs import JobAccepted, JobReport, QueueMode
from maya_un.schema.previews import JobInspection, JobPreview
from maya_un.schema.robot import (
    DatumView,
    HeldJog,
    Jogged,
    LinkView,
    NextStep,
    Signals,
    Status,
    SteeredJog,
    Table,
    TableView,
    TerminalReply,
)
from maya_un.service import permissions
from maya_un.service.access.control import AccessControl
from maya_un.service.access.operations import LOCAL, MOVING, QUEUEING, RULES, STOPPING, Caller, Operation, require
from maya_un.service.calibration.service import CalibrationService
from maya_un.service.computing import Computing
from maya_un.service.configuring import ConfigService
from maya_un.service.direct import PATIENCE, DirectCommands, HeldJogs
from maya_un.service.fleet import FleetService
from maya_un.service.margins import MarginSnapshot
from maya_un.service.motion import MotionSnapshot
from maya_un.service.people import LeaseService, UserService
from maya_un.service.places import TeachingService, at_rest, drop_zone, put_zone, zones_of
from maya_un.service.previews import PreviewService, require_samples
from maya_un.service.queueing import HistoryService, QueueService, RecordingService
from maya_un.service.twin import FaultInjector, TwinService
from maya_un.values import Joints, Point, State, StopReport
from maya_un.workers import Workers

MOST_REPLY = 20_000
"""Maximum length of an answer in the terminal [characters]."""


class TwinParts(Protocol):
    """The parts of a twin, and its true pose."""

    @property
    def parts(self) -> Mapping[str, Point]:
        """The grasp points of the parts, by name [m]."""
        ...

    def true_joints(self) -> tuple[float, float, float]:
        """Return the true angle [rad] and the true line lengths [m]."""
        ...

    @property
    def carried(self) -> str | None:
        """The part between the jaws, None without one."""
        ...


class Service:
    """The service of a robot.

    `address` is that of the machine, `speed` that of its clock; `status` has both. `teaching` reads and changes the
    `store` of taught places, which `process` also reads; without a `store` there are none. Requests without motion are
    computed in `workers`, if given. `twin` has the parts of a twin in this process. The configuration of the next start
    is written to `config_file`, if given. `faults` injects those of a twin. The points of a calibration are in the file
    `measured_points`.
    """

    def __init__(  # noqa: PLR0913 - every part of the service is a parameter
        self,
        process: Process,
        robot: Robot,
        controller: Controller,
        config: Config,
        *,
        address: str = SIM,
        speed: float = 1.0,
        store: PoseStore | None = None,
        access: AccessControl | None = None,
        recorder: Recorder | None = None,
        workers: Workers | None = None,
        twin: TwinParts | None = None,
        config_file: Path | None = None,
        faults: FaultInjector | None = None,
        measured_points: Path | None = None,
    ) -> None:
        kept = PoseStore(controller.mechanism) if store is None else store
        height, events = config.cell.grasp_height, controller.events
        self.teaching = TeachingService(kept, height, lambda: at_rest(controller), events)
        self.history = HistoryService(process, controller.events)
        self._process = process
        self._robot = robot
        self._controller = controller
        self._config = config
        self._address = address
        self._speed = speed
        self._parts = twin
        self._terminal = asyncio.Lock()
        self._held = HeldJogs(controller, PATIENCE * max(1.0, speed), process.scheduler)
        self.direct = DirectCommands(process, robot, controller, self._held.halt)
        shared = AccessControl.alone(controller.events, speed) if access is None else access
        self.access = shared
        self.queue = QueueService(process, shared.lease)
        self.lease = LeaseService(shared, self._held.halt)
        self.recorder = RecordingService(recorder, workers)
        self.users = UserService(shared, self._rights_ended)
        self.configuring = ConfigService(config, config_file, Computing(workers))
        self.faults = TwinService(faults)
        self.fleet = FleetService()
        self.calibration = CalibrationService(measured_points, controller, config, workers)
        self.previews = PreviewService(controller, process.computer, self._start, config, workers)

    async def submit(
        self,
        job: Job | Mapping[str, object] | bytes,
        *,
        by: Caller = LOCAL,
        options: JobOptions = DEFAULT_OPTIONS,
        key: str = "",
        stopped: bool = False,
    ) -> JobAccepted:
        """Append a job, which may be JSON, to the queue; before its start, it is checked as a whole.

        The job is stored when this returns. A repeated request with the same `key` and owner returns the existing job.
        If a stop came after the request (`stopped`), the queue pauses, as if the job had waited already. A student's
        job waits for approval, unless the student drives.

        Raises `KeyReused` for the key of another request, `StorageFailed`, `InvalidJob`, `UnknownName`, `InvalidValue`
        for options out of range, `FileUnreadable` if the file of taught places is not valid and the job needs it, and
        `NotConnected` or `Faulted` while nothing can run.
        """
        number = await self._process.submit(job, self._asked(by, options, key), stopped=stopped)
        line = await self._process.views.found_line(number)
        return JobAccepted(number, line.name, line.steps)

    async def command(
        self,
        command: Primitive | Mapping[str, object],
        *,
        wait: bool = True,
        by: Caller = LOCAL,
        options: JobOptions = DEFAULT_OPTIONS,
        key: str = "",
    ) -> JobReport:
        """Append one primitive as a separate job; with `wait`, return its report when it has ended.

        Its target may be the name of a taught pose or the cell of a taught pallet, its joints the name of a pose.

        Raises `InvalidRequest`, `UnknownName`, `InvalidValue`, and `NotConnected` or `Faulted`. Later refusals and
        failures are in the report. It is done at once if the queue is paused and nothing runs, unless `options` are
        given.
        """
        number = await self._process.command(command, self._asked(by, options, key))
        return await (self._process.result(number) if wait else self._process.views.report(number))

    def _rights_ended(self, token: str, name: str, why: str) -> None:
        """End the lease of a user whose token ended; without a token, of one with fewer rights, and pause the job."""
        self.lease.rights_ended(token, name, why)
        if not token and name != LOCAL.name:
            self._process.owner_ended(name)

    def _asked(self, by: Caller, options: JobOptions, key: str) -> SubmitRequest:
        return SubmitRequest(RequestOwner(by.name, by.source), options, key, proposal=self.queue.proposes(by))

    async def jog(self, axis: str, distance: float, *, speed: float = 1.0, clip: bool = True) -> Jogged:
        """Move along an axis (a, b, c; x, y, z, r of the gripper) by `distance` (rad or m) at `speed` (0 to 1).

        It moves as far as the workspace allows, decelerates before the border, and returns the distance; with `clip`
        false, a longer distance is refused. A job that becomes due waits. Raises `Busy` while a job runs, and the
        errors of a motion.
        """
        self.require_free()
        with self._process.scheduler.aside("jog"):
            return await self._controller.jog(axis, distance, speed=speed, clip=clip)

    async def jog_hold(self, axis: str, direction: int, *, speed: float = 1.0, press: str | None = None) -> HeldJog:
        """Jog in `direction` (1 or -1) while this is called again, each time within 0.5 s; return at once.

        On a twin with a faster clock, this period is in real time. A `press` that has ended moves nothing any more.
        Raises as `jog` does.
        """
        self.require_free()
        return await self._held.hold(axis, direction, speed, press)

    async def jog_vector(self, vector: tuple[float, float, float], *, press: str | None = None) -> SteeredJog:
        """Jog the gripper straight along `vector`, whose length (0.01 to 1) is the share of the full speed.

        It lasts as `jog_hold` does. The speed changes at once; for a direction that differs by more than 0.2 rad the
        robot first comes to rest on its path. Raises as `jog` does, and `InvalidValue` for another length.
        """
        self.require_free()
        return await self._held.steer(vector, press)

    async def jog_release(self, press: str | None = None) -> None:
        """Stop the held jog, if any, on its path; with `press`, only if this press began it."""
        await self._held.release(press)

    async def check_storage(self) -> str:
        """Return the reason why the journal cannot be written, "" if it can; in that case, pause the queue."""
        return await self._process.check_storage()

    async def job(self, number: int) -> JobReport:
        """Return the report of a job, also of one that ended long ago; raises `NotFound`."""
        return await self._process.views.report(number)

    async def wait(self, number: int) -> JobReport:
        """Wait until a job has ended and return its report; raises `NotFound`."""
        return await self._process.result(number)

    async def cancel(self, number: int, *, by: Caller = LOCAL) -> JobReport:
        """Cancel a job; a running one stops on its path. Returns when it is at rest.

        Raises `NotFound`, `NotAllowed`, `StorageFailed`.
        """
        await self.queue.require_over(number, Operation.CANCEL, by)
        return await self._process.cancel(number)

    async def stop(self) -> StopReport:
        """Start braking at once; return the time and distance to rest, and the job that ends.

        The queue is paused if jobs wait in it. Raises `NotConnected`; the queue is paused all the same.
        """
        running = self._process.scheduler.running
        self._process.scheduler.halt(Stopped())
        self._held.halt()
        report = await self._controller.stop()
        return report if running is None else replace(report, job=running.number)

    @property
    def stops(self) -> int:
        """How often the robot was stopped."""
        return self._controller.stops

    async def pause(self) -> StopReport:
        """Brake on the path and hold all motion until `resume`; return the time and distance to rest.

        The running job is paused and later continues from there; a job between two motions is held before the next.
        Raises `CannotPause` without a running job and during homing; `NotConnected`, `Faulted`.
        """
        return await self._process.scheduler.pause_motion()

    async def resume(self) -> None:
        """Resume motion after a pause; raises `NotPaused`, `NotConnected`. A paused queue stays paused."""
        await self._process.scheduler.resume_motion()

    async def speed(self, ratio: float) -> None:
        """Scale the speed of all motion by `ratio` (0.01 to 1), also of the running motion; raises `InvalidValue`."""
        await self._controller.override(ratio)

    async def abort(self) -> None:
        """Stop without deceleration, and pause the queue if jobs wait in it; raises `NotConnected`."""
        self._process.scheduler.halt(Stopped())
        self._held.halt()
        await self._controller.abort()

    async def recover(self, *, take_over: bool = False) -> None:
        """Clear a fault after its cause is removed, without motion; raises `NothingToRecover`.

        `take_over` takes the controller from another program that owns it; otherwise this raises `ControllerOwned`.
        """
        await self._controller.recover(take_over=take_over)

    def datum(self) -> DatumView:
        """Return whether homing needs a person, and the datum that a person gave."""
        given, needed = self._controller.datum, self._config.person_needed
        return DatumView(
            needed=bool(needed),
            reason=needed,
            given=None if given is None else given.joints,
            confirmed=None if given is None else given.confirmed,
            homed_pose=homed_pose(self._config),
        )

    @property
    def state(self) -> State:
        """The latest state of the machine."""
        return self._controller.state

    @property
    def running(self) -> int | None:
        """The number of the running job, None without one."""
        return self._process.running

    def signals(self) -> Signals | None:
        """Return signals of the controller; None while disconnected, and where only another process has them."""
        return self._controller.signals()

    def margins(self) -> MarginSnapshot | None:
        """Return the position of the robot in its workspace, None before homing."""
        joints = self._controller.state.joints
        return None if joints is None else MarginSnapshot(self._controller.workspace, joints)

    @property
    def name(self) -> str:
        """The name of the robot."""
        return self._config.coms.name

    def link(self) -> LinkView:
        """Return the quality of the link to the controller."""
        return self._controller.link(self._speed)

    async def interrogate(self, command: str) -> TerminalReply:
        """Return the controller's answer to a command that only reads, also while a motion or a job runs.

        Such commands are sent one after another. Raises `TerminalReadsOnly` for any other text, `NotConnected`, and
        `NotOverRos` where another process has the controller.
        """
        async with self._terminal:
            try:
                reply = await self._controller.interrogate(command)
            except CommandRejected as error:
                return TerminalReply(command, "", int(str(error.details["tc"])), str(error.details["reason"]))
        return TerminalReply(command, reply[:MOST_REPLY])

    @property
    def move(self) -> CoordinatedMove | None:
        """The move under way; every change of its speed makes another one."""
        run = self._controller.run
        return None if run is None else run.move

    def motion(self) -> MotionSnapshot | None:
        """Return the motion under way and the step after the running one, None without both.

        No motion is known in a homing, and where another process carries motions out.
        """
        run, ahead = self._controller.run, self.next_step()
        if run is None:
            return None if ahead is None else MotionSnapshot(None, None, self._controller.mechanism, ahead)
        return MotionSnapshot(run.move, run.began, self._controller.mechanism, ahead)

    def next_step(self) -> NextStep | None:
        """Return the step after the running one, None without one.

        Once the path of the step is computed, a new object is returned.
        """
        return self._process.ahead.look()

    def table(self) -> TableView:
        """Return the parts by name with their places [m], from the twin, or on a machine as jobs tell them."""
        holding = self._robot.holding
        if self._parts is None:
            believed = self._process.parts
            return TableView("believed", believed.places, believed.held if holding else None, holding)
        carried = self._parts.carried
        parts = {name: None if name == carried else place for name, place in self._parts.parts.items()}
        return TableView("twin", parts, carried, holding)

    async def twin(self) -> Table:
        """Return the positions of the parts on the table of the twin [m], and its true joints.

        Raises `NotFound` on a machine.
        """
        if self._parts is None:
            raise NotFound(what="twin", number="on a real machine")
        return Table(dict(self._parts.parts), Joints(*self._parts.true_joints()))

    def refusals(self, by: Caller = LOCAL) -> dict[str, MayaError | None]:
        """Return for each action of a user the error that would refuse it now, None if it is allowed."""
        return permissions.refusals(self, self.access.lease, by)

    @property
    def circumstances(self) -> object:
        """The facts on which `refusals` depend, besides the caller; equal ones have equal answers."""
        return permissions.circumstances(self, self.access.lease)

    async def status(self) -> Status:
        """Return the current status."""
        jobs = self._process.views.first_lines()
        mode, given = self._process.views.mode, self._controller.datum
        return Status(
            version=maya_un.__version__,
            address=self._address,
            speed=self._speed,
            state=self._controller.state,
            progress=self._controller.progress(),
            can_teleop=self._robot.can_teleop and not (jobs and mode is QueueMode.RUNNING),
            holding=self._robot.holding,
            jobs=jobs,
            last_event=len(self._controller.events),
            run=self._controller.events.run,
            queue=mode,
            reason=self._process.views.reason,
            unconfirmed=given is not None and not given.confirmed,
            question=self._process.views.question,
        )

    def follow_events(self, seq: int = 0) -> AsyncIterator[Event]:
        """Yield every event numbered above `seq` without gaps: first the past ones, then new ones as they occur.

        The first event has number 1. Raises `EventsForgotten`.
        """
        return self._controller.events.follow(seq)

    def watch(self) -> AsyncIterator[State]:
        """Yield the current state of the machine and every newer one; a slow reader skips to the newest."""
        return self._controller.watch()

    async def preview(self, job: Job | Mapping[str, object], *, from_homed: bool = False) -> JobPreview:
        """Return the preview of a job: times, heights, end counts, and the first refusal; nothing moves.

        It starts at the current position, or with `from_homed` at that after homing. Raises `InvalidJob` and
        `UnknownName`.
        """
        parsed = job if isinstance(job, Job) else Job.parse(job)
        return await self._process.preview(parsed, self._start(from_homed))

    async def inspect(
        self, job: Job | Mapping[str, object], *, from_homed: bool = False, samples: int = 200
    ) -> JobInspection:
        """Return a job in detail: its preview, profiles of the axes, smallest margins, longest stop; nothing moves.

        `samples` is the number per motion, 2 to 10 000. Raises as `preview` does, and `InvalidValue`.
        """
        require_samples(samples)
        parsed = job if isinstance(job, Job) else Job.parse(job)
        return await self._process.inspect(parsed, self._start(from_homed), samples)

    def _start(self, from_homed: bool, /) -> Pose:
        here = self._robot.pose
        return here._replace(joints=homed_pose(self._config)) if from_homed else here

    async def zones(self) -> list[AnyZone]:
        """Return the keep-out zones in the format of the configuration."""
        return zones_of(self._controller)

    async def set_zone(self, zone: Mapping[str, object]) -> AnyZone:
        """Add a keep-out zone for this run, or replace the zone with the same name.

        A zone that contains the robot is accepted; then no motion is allowed before it is removed. Raises
        `InvalidRequest` with an invalid key, and `Busy` while a job runs or the robot moves.
        """
        self.require_free()
        return put_zone(self._controller, zone)

    async def remove_zone(self, name: str) -> None:
        """Remove a keep-out zone for this run; raises `NotFound` and `Busy`."""
        self.require_free()
        drop_zone(self._controller, name)

    def config(self) -> Config:
        """Return all constants of the machine."""
        return self._config

    def require_free(self) -> None:
        """Raise `Busy` while a job or a direct command runs."""
        if self._process.running is not None:
            raise Busy(doing=phrase("job {number:d}", number=self._process.running))
        self.direct.require_free()


T = TypeVar("T")

OnAudit = Callable[[Caller, Operation, int, str], None]
"""Called for every passed or refused operation, with the error code or 0, and its subject."""

QUIET = frozenset({Operation.READ, Operation.PREVIEW, Operation.RENEW, Operation.DIAGNOSE})
"""Operations that the audit log leaves out unless they are refused, because they change nothing."""


def unheard(_caller: Caller, _operation: Operation, _code: int, _detail: str) -> None:
    """Do nothing: a service without shared access has no audit log."""


Current = Callable[[Caller], Caller]
"""Returns a caller with the current rights; raises `NotSignedIn` if they have ended."""


def unchanged(caller: Caller) -> Caller:
    """Return the caller unchanged, for a service without users."""
    return caller


class Gate:
    """Calls `service` for callers, as far as their role and the `lease` allow; `audit` records each call.

    `current` returns the present rights of a caller, because the interface may have checked them earlier.
    """

    def __init__(
        self, service: Service, lease: ControlLease, audit: OnAudit = unheard, current: Current = unchanged
    ) -> None:
        self._service = service
        self._lease = lease
        self._audit = audit
        self._current = current

    async def call(
        self,
        caller: Caller,
        operation: Operation,
        work: Callable[[Service], Awaitable[T]],
        detail: str = "",
        *,
        stops: int | None = None,
    ) -> T:
        """Return the result of `work`; `detail` is its subject in the audit log ("job 17").

        `stops` is the number of stops when the request came, None for now. If the robot was stopped since, nothing
        begins that could move it.

        A request that needs the lease ends with it: if another user takes the lease, if it expires, or if its holder is
        demoted or removed, the request is cancelled, and its motion stops on the path. Jobs differ: if the owner is
        demoted or removed, the running step is finished, then the queue pauses (`Process.owner_ended`).

        Raises `NotSignedIn` for a caller whose rights ended after the interface checked them, `NotAllowed`,
        `LeaseNeeded`, `LeaseHeld`, `LeaseLost`, `Stopped`, and what `work` raises.
        """
        code = InternalError.code
        try:
            if operation not in STOPPING:
                caller = self._current(caller)
            require(caller, operation)
            if stops not in {None, self._service.stops} and operation in MOVING | QUEUEING:
                raise Stopped
            if operation in MOVING:
                work = self._unless_stopped(work)
            answer = await (self._driven(caller, work) if RULES[operation].drives else work(self._service))
            code = 0
            return answer
        except MayaError as error:
            code = error.code
            raise
        except asyncio.CancelledError:
            code = Cancelled.code
            raise
        finally:
            if operation not in QUIET or code == NotAllowed.code:
                self._audit(caller, operation, code, detail)

    async def _driven(self, caller: Caller, work: Callable[[Service], Awaitable[T]]) -> T:
        """Carry out a request while the caller holds the lease."""
        shown = caller.lease
        if not shown and not caller.implicit:
            self._lease.require(shown, caller.name)
        with self._lease.driving(caller.name, caller.source, shown, direct=True) as drive:
            task = asyncio.ensure_future(work(self._service))
            drive.carry(task)
            try:
                return await run_to_rest(task)
            except asyncio.CancelledError:
                if not drive.lost or is_caller_cancelled():
                    raise
                raise LeaseLost(reason=drive.lost) from None

    def _unless_stopped(self, work: Callable[[Service], Awaitable[T]]) -> Callable[[Service], Awaitable[T]]:
        """Return `work`, which raises `Stopped` if the robot is stopped before it begins, a turn of the loop later."""
        stops = self._service.stops

        async def begun(service: Service) -> T:
            if stops != service.stops:
                raise Stopped
            return await work(service)

        return begun
