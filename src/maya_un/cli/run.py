"""`maya run`: carry out a job, on a separate stack or by the running robot, and report the result."""

from __future__ import annotations

import asyncio
import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from math import dist
from pathlib import Path
from typing import Any, NamedTuple

from dmc41x3.address import SIM
from dmc41x3.cli.signals import on_end
from dmc41x3.i18n import marked, translate
from dmc41x3.loops import ScaledLoop, run_virtual
from dmc41x3.loops import run as run_loop
from maya_un.assembly.stack import Stack, stack
from maya_un.cli import output
from maya_un.cli.addresses import clock_factor, target_address
from maya_un.cli.client import ServiceClient
from maya_un.cli.configure import configuration, parts_of, require_twin, taught_places, truth_of_twin
from maya_un.cli.progress import Display, chosen, computing, tell
from maya_un.cli.questions import answer_questions
from maya_un.cli.recordings.recordings import store
from maya_un.cli.report import as_data, as_text
from maya_un.cli.settings import OutputSettings
from maya_un.cli.units import units_of
from maya_un.cli.waiting import INTERRUPTION, follow
from maya_un.client import requests
from maya_un.config import Config
from maya_un.errors import InvalidCommandLine, InvalidJob, MayaError
from maya_un.http.log import keep_quiet
from maya_un.kinematics.mechanism import Mechanism
from maya_un.process.spec.documents import located
from maya_un.process.spec.job import Job, load_job
from maya_un.schema.encoding import to_data
from maya_un.schema.jobs import JobReport
from maya_un.values import Joints

FRAME = 0.1
"""Period of updating the progress of a motion [s, real time]."""

SAME = 1e-4
"""A robot with the same constants places its gripper so near to where this configuration places it [m]."""

HORIZON = 1e9
"""Longest job of a dry run [s]."""


class RunOptions(NamedTuple):
    """Options of `maya run`; None if not given."""

    dry_run: bool = False
    address: str | None = None
    speed: float | None = None
    seed: int | None = None
    truth: str | None = None
    skip_home: bool = False
    plot: str | None = None
    take_over: bool = False

    @property
    def own_stack(self) -> bool:
        """Whether the options require a separate stack instead of the running robot."""
        of_stack = (self.address, self.speed, self.seed, self.truth)
        return self.skip_home or self.take_over or any(option is not None for option in of_stack)


class RunOutcome(NamedTuple):
    """A report as data, and whether it was interrupted by Ctrl-C or SIGTERM."""

    report: dict[str, Any]
    interrupted: bool = False


def run(file: str, options: RunOptions, settings: OutputSettings) -> int:
    """Carry out the job of `file`, print its report, and return the exit code: 0 only if every step was done."""
    config = configuration(settings)
    address = target_address(options.address or SIM, config.controller.address)
    factor = clock_factor(options.speed, address)
    require_twin(address, "maya run", seed=options.seed, truth=options.truth)
    if options.plot is not None and not options.dry_run:
        raise InvalidCommandLine(reason="--plot draws a dry run, so it needs --dry-run", command="maya run")
    with located(Path(file)):
        job = load_job(Path(file))
        if options.dry_run:
            outcome = _dry_run(job, config, address, options, settings)
        else:
            client = None if options.own_stack else ServiceClient.running()
            with chosen(settings) as display:
                if client is not None:
                    outcome = _by_service(client, job, display, settings)
                else:
                    outcome = _own_stack(job, config, address, factor, options, display, settings)
    return _concluded(outcome, settings)


def _concluded(outcome: RunOutcome, settings: OutputSettings) -> int:
    report = outcome.report
    if settings.json:
        output.emit(report)
    else:
        output.say(as_text(report, settings.language, units_of(settings)))
    if outcome.interrupted:
        return output.INTERRUPTED
    return output.concluded(report, settings)


class _Standing(NamedTuple):
    """A homed robot at rest: its joints and whether its gripper is closed."""

    joints: Joints
    closed: bool


def _dry_run(job: Job, config: Config, address: str, options: RunOptions, settings: OutputSettings) -> RunOutcome:
    """Carry out the job on the twin in virtual time.

    If the running robot is homed, the twin begins where it stands. For a real machine, the twin is homed first.
    """
    if options.plot is not None:
        _require_format(Path(options.plot))
    like = None if options.own_stack else _standing(config)
    if not settings.json:
        output.say(translate("Dry run on the twin: nothing real moves.", settings.language))
        if like is not None:
            output.say(translate("The twin begins homed, like the running robot.", settings.language))
    on_twin = options._replace(skip_home=False, take_over=False)
    with computing(marked("Dry run"), settings) as display:
        performance = _JobRun(job, display, settings, home_first=address != SIM or options.skip_home, like=like)
        outcome = run_virtual(performance.perform(config, SIM, on_twin), HORIZON)
    if options.plot is not None:
        _draw(job, config, Path(options.plot), settings)
    return outcome


def _standing(config: Config) -> _Standing | None:
    """Return how the running robot stands.

    The result is None if no robot runs, if it is not homed and at rest, if it has other constants than `config`, or if
    the service does not answer.
    """
    with suppress(MayaError):
        client = ServiceClient.running()
        state = None if client is None else client.ask(requests.status())["state"]
        if state is None or not state["homed"] or state["mode"] != "idle":
            return None
        joints = Joints(*state["joints"])
        if dist(Mechanism.of(config).fk(joints), state["point"]) < SAME:
            return _Standing(joints, state["gripper_closed"])
    return None


def _require_format(path: Path) -> None:
    """Raise `InvalidValue` before the run for a picture in an unknown format."""
    from maya_un.plots import style

    style.kind_of(path)


def _draw(job: Job, config: Config, path: Path, settings: OutputSettings) -> None:
    """Write the picture of a job, if it contains a motion; raises `InvalidValue` and `FileUnwritable`."""
    from maya_un.cli.plot import draw

    with suppress(InvalidJob):
        draw(job, config, path, settings)
        if not settings.json:
            output.say(translate("Picture: {path}", settings.language, path=path))


def _own_stack(
    job: Job,
    config: Config,
    address: str,
    factor: float,
    options: RunOptions,
    display: Display,
    settings: OutputSettings,
) -> RunOutcome:
    text = marked("On the twin, clock × {speed:g}.") if address == SIM else marked("On the controller at {address}.")
    display.note(translate(text, settings.language, speed=factor, address=address))
    performance = _JobRun(
        job,
        display,
        settings,
        factor=factor,
        pace=FRAME * factor,
    )
    clock: Callable[[], asyncio.AbstractEventLoop] | None = (lambda: ScaledLoop(factor)) if address == SIM else None
    return run_loop(performance.perform(config, address, options), clock)


class _JobRun:
    """One job on a separate stack.

    `pace` is the period of updating the progress [s, of the stack's clock], None for no updates. `home_first` homes
    before the job; with `like` the robot then also stands like another one.
    """

    def __init__(
        self,
        job: Job,
        display: Display,
        settings: OutputSettings,
        *,
        factor: float = 1.0,
        pace: float | None = None,
        home_first: bool = False,
        like: _Standing | None = None,
    ) -> None:
        self._job = job
        self._factor = factor
        self._display = display
        self._settings = settings
        self._pace = pace
        self._home_first = home_first or like is not None
        self._like = like
        self._ending = False

    async def perform(self, config: Config, address: str, options: RunOptions) -> RunOutcome:
        """Carry out the job and return its report."""
        keep_quiet(asyncio.get_running_loop())
        seed = options.seed or 0
        parts = parts_of(self._job, config, self._settings)
        async with stack(
            config,
            address,
            seed=seed,
            parts=parts,
            truth=truth_of_twin(options.truth, config, seed),
            live=self._pace is not None,
            skip_home=options.skip_home,
            take_over=options.take_over,
            speed=self._factor,
            places=taught_places(self._settings),
            recordings=store(config.recorder),
        ) as robot:
            if robot.twin is not None and config.person_needed:
                where = Joints(*robot.twin.mechanics.true_joints())
                await robot.controller.give_datum(where, by="maya run", confirmed=True)
                await robot.controller.gripper(open_=True)
            if self._home_first:
                await robot.controller.home()
            if self._like is not None:
                with suppress(MayaError):  # a place that cannot be reached straight: the homed pose will do
                    await robot.controller.move(self._like.joints)
                await robot.controller.gripper(not self._like.closed)
            accepted = await robot.service.submit(self._job)
            report, interrupted = await self._watched(robot, accepted.id)
            places = None if robot.twin is None else robot.twin.mechanics.parts
            return RunOutcome(as_data(to_data(report), places), interrupted)

    async def _watched(self, robot: Stack, job: int) -> tuple[JobReport, bool]:
        answers = answer_questions(robot, job, self._display, self._settings.language, dry=self._pace is None)
        works = (self._narrate(robot), self._animate(robot), answers)
        watchers = [asyncio.create_task(work) for work in works]
        with self._ended_by_sigterm():
            try:
                return await robot.service.wait(job), False
            except asyncio.CancelledError:
                self._ending = True
                _go_on()
                self._display.note(translate(INTERRUPTION, self._settings.language))
                return await robot.service.cancel(job), True
            finally:
                for watcher in watchers:
                    watcher.cancel()
                await asyncio.gather(*watchers, return_exceptions=True)

    @contextmanager
    def _ended_by_sigterm(self) -> Iterator[None]:
        """Make SIGTERM act as Ctrl-C in the main thread; only once, because a stop is then in progress."""
        task = asyncio.current_task()
        if threading.current_thread() is not threading.main_thread() or task is None:
            yield
            return

        def end() -> None:
            if not self._ending:
                self._ending = True
                task.cancel()

        with on_end(end, signal.SIGTERM):
            yield

    async def _narrate(self, robot: Stack) -> None:
        async for event in robot.controller.events.follow():
            tell(event, self._display, self._settings.language)

    async def _animate(self, robot: Stack) -> None:
        while self._pace is not None:
            progress = robot.controller.progress()
            if progress is None:
                self._display.rest()
            else:
                self._display.motion(progress.phase, progress.elapsed, progress.duration)
            await asyncio.sleep(self._pace)


def _go_on() -> None:
    """Undo the cancellation by Ctrl-C: the task must still wait for the stop and report."""
    task = asyncio.current_task()
    if task is not None:
        task.uncancel()


def _by_service(client: ServiceClient, job: Job, display: Display, settings: OutputSettings) -> RunOutcome:
    url = f"http://{client.host}:{client.port}"
    display.note(translate("With the running robot at {url}.", settings.language, url=url))
    since = client.ask(requests.status())["last_event"]
    accepted = client.ask(requests.submit(job.as_data()))
    report, interrupted = follow(client, accepted["id"], since, display, settings)
    places = client.ask(requests.twin())["parts"] if client.ask(requests.status())["address"] == SIM else None
    return RunOutcome(as_data(report, places), interrupted)
