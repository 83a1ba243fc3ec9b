"""`maya up`: run a robot in this thread, and its HTTP server in another.

It prints a banner (address, waiting jobs, next commands), and sends messages to systemd (sd_notify(3)). Before it ends,
it stops the robot on its path, or finishes the running step.
"""

from __future__ import annotations

import asyncio
import os
import re
import signal
import socket
from collections.abc import AsyncIterator, Callable, Iterator, Sequence
from contextlib import AsyncExitStack, ExitStack, asynccontextmanager, contextmanager, suppress
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from dmc41x3.address import SIM, parse
from dmc41x3.cli.signals import on_end
from dmc41x3.i18n import marked, translate
from dmc41x3.listening import reserve_descriptors
from dmc41x3.loops import ScaledLoop, run
from maya_un import runtime
from maya_un.assembly.stack import Stack, stack, storage
from maya_un.assembly.staff import staffed
from maya_un.cli import output
from maya_un.cli.addresses import clock_factor, target_address
from maya_un.cli.configure import config_file, configuration, on_the_table, require_twin, taught_places, truth_of_twin
from maya_un.cli.fleet.watching import fleet_beside
from maya_un.cli.recordings.recordings import store
from maya_un.cli.service.browser import show_page
from maya_un.cli.service.listeners import RemoteAccess, graph_at, require_users, url_of
from maya_un.cli.settings import OutputSettings
from maya_un.cli.waiting import because
from maya_un.config import Config
from maya_un.config.state_folder import own_queue_file
from maya_un.dashboard.pages import add_dashboard
from maya_un.errors import InvalidValue, MayaError
from maya_un.http import dates, log
from maya_un.http.app import create_app
from maya_un.http.bridge import Bridge
from maya_un.http.log import keep_quiet
from maya_un.http.metrics import Metrics
from maya_un.http.sockets import PORT, ListeningSocket, bound_socket
from maya_un.http.thread import served
from maya_un.interpreter import prompt_loop
from maya_un.process.journal.file import remove_new, require_place
from maya_un.schema.jobs import QueueMode, QueueView
from maya_un.values import Mode, Point

if TYPE_CHECKING:
    from maya_un.edges import EndpointOptions, Ros2Options
    from maya_un.machine.truth import TrueConstants


@dataclass(frozen=True, slots=True)
class StartupBanner:
    """The content of the banner: `far` is the URL for other computers, `rosbridge` that of its endpoint.

    `ros2` is the domain of the ROS 2 graph.

    `refusal` is the error that prevented the use of a stored homing.
    """

    url: str
    far: str | None
    address: str
    speed: float
    journal: Path | None
    queue: QueueView
    refusal: MayaError | None
    rosbridge: str | None = None
    ros2: int | None = None


def greet(greeting: StartupBanner, settings: OutputSettings) -> None:
    """Print the banner."""
    if settings.json:
        output.emit(_data(greeting, settings.language))
        return
    if greeting.refusal is not None:
        output.complain(greeting.refusal, settings)
    for line in _lines(greeting, settings.language):
        output.say(line)


def _data(greeting: StartupBanner, language: str) -> dict[str, object]:
    refusal, queue = greeting.refusal, greeting.queue
    return {
        "url": greeting.url,
        "remote": greeting.far,
        "rosbridge": greeting.rosbridge,
        "ros2": greeting.ros2,
        "pid": os.getpid(),
        "address": greeting.address,
        "speed": greeting.speed,
        "journal": None if greeting.journal is None else str(greeting.journal),
        "queue": queue.mode.value,
        "reason": queue.reason,
        "jobs": queue.counts,
        "interrupted": None if queue.recovery is None else queue.recovery.job,
        "code": 0 if refusal is None else refusal.code,
        "message": "" if refusal is None else refusal.text(language),
    }


def _lines(greeting: StartupBanner, language: str) -> Iterator[str]:
    yield translate("Dashboard: {url}", language, url=greeting.url)
    yield translate(
        "Maya is up on {address}, clock × {speed:g}. Service: {url}",
        language,
        address=greeting.address,
        speed=greeting.speed,
        url=greeting.url,
    )
    if greeting.far is not None:
        yield translate("For other machines, with a token: {url}", language, url=greeting.far)
    if greeting.rosbridge is not None:
        yield translate("rosbridge: {url}", language, url=greeting.rosbridge)
    if greeting.ros2 is not None:
        yield translate("ROS 2: domain {domain}", language, domain=greeting.ros2)
    queue = greeting.queue
    if queue.recovery is not None:
        found = queue.recovery
        text = _INTERRUPTED if found.index else _INTERRUPTED_BETWEEN
        yield translate(text, language, job=found.job, name=found.name, index=found.index, step=found.step)
    waiting = sum(queue.counts.values()) - (queue.recovery is not None)
    if waiting:
        reason = because({"reason": queue.reason, "by": queue.by}, language)
        yield translate(_waiting(queue), language, count=waiting, reason=reason)
    yield translate(
        "Next, in another terminal: maya home · maya status · maya run JOB · maya stop.\nCtrl-C ends `maya up`.",
        language,
    )


def _waiting(queue: QueueView) -> str:
    if queue.recovery is not None:
        return marked("Jobs waiting behind it: {count}.")
    if queue.mode is QueueMode.RUNNING:
        return marked("Jobs waiting from before this start: {count}.")
    return marked(
        "Jobs waiting from before this start: {count}; the queue is paused ({reason}). `maya queue resume` continues."
    )


_INTERRUPTED = marked(
    "Job {job} ({name}) was interrupted at step {index}, {step}. Nothing moves by itself: `maya queue` shows the job, "
    "`maya queue recover` decides about it."
)
_INTERRUPTED_BETWEEN = marked(
    "Job {job} ({name}) was interrupted between two steps. Nothing moves by itself: `maya queue` shows the job, "
    "`maya queue recover` decides about it."
)


def tell(words: str) -> None:
    """Send a message like "READY=1" to $NOTIFY_SOCKET; do nothing if no program listens there."""
    place = os.environ.get("NOTIFY_SOCKET", "")
    if not place.startswith(("/", "@")):
        return
    address = f"\0{place[1:]}" if place.startswith("@") else place
    with suppress(OSError), socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM | socket.SOCK_CLOEXEC) as mouth:
        mouth.sendto(words.encode(), address)


def interval() -> float | None:
    """Return the period of watchdog messages to systemd [s, real time], None if it expects none.

    It is half of $WATCHDOG_USEC, as sd_watchdog_enabled(3) advises.
    """
    meant = os.environ.get("WATCHDOG_PID", str(os.getpid()))
    microseconds = os.environ.get("WATCHDOG_USEC", "")
    if meant != str(os.getpid()) or not microseconds.isdecimal() or int(microseconds) == 0:
        return None
    return int(microseconds) / 2e6


async def stay_alive(speed: float) -> None:
    """Send watchdog messages from the running loop, whose clock is `speed` times real time, until cancelled."""
    every = interval()
    while every is not None:
        tell("WATCHDOG=1")
        await asyncio.sleep(every * speed)


FINISH = signal.SIGUSR1
"""The signal that `maya down --finish` sends."""

_MOVING = {Mode.MOVING, Mode.HOMING, Mode.STOPPING}
_ORDINARY = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


class ShutdownRequest:
    """The requested end of the program: the first signal sets `asked`, a second one `hurried`.

    With `finish`, the running step is finished first; the signal of `maya down --finish` sets it too.
    """

    def __init__(self, *, finish: bool) -> None:
        self.finish = finish
        self.asked = asyncio.Event()
        self.hurried = asyncio.Event()

    @contextmanager
    def listening(self) -> Iterator[None]:
        """Handle signals while the block runs; must run in the main thread."""
        with ExitStack() as signals:
            signals.enter_context(on_end(self._end, *_ORDINARY))
            signals.enter_context(on_end(self._finish, FINISH))
            yield

    def _end(self) -> None:
        (self.hurried if self.asked.is_set() else self.asked).set()

    def _finish(self) -> None:
        if not self.asked.is_set():
            self.finish = True
        self.asked.set()


async def brought_to_rest(running: Stack, ending: ShutdownRequest, settings: OutputSettings) -> None:
    """End running jobs and return when the robot is at rest and all data are stored; print how it ends."""
    under_way = running.process.running
    finish = ending.finish and under_way is not None
    if not settings.json:
        text = _ending(finish=finish, job=under_way)
        output.say(translate(text, settings.language, job=under_way))
    if finish:
        await _finished(running, ending, settings)
    else:
        await running.process.close()
    await _come_to_rest(running)


def _ending(*, finish: bool, job: int | None) -> str:
    if job is None:
        return marked("Ending.")
    if finish:
        return marked("Ending after the running step of job {job}; repeat the command to stop now.")
    return marked(
        "Ending. The robot decelerates along the path. Job {job} is interrupted; decide about it after the "
        "next start with `maya queue recover`."
    )


async def _finished(running: Stack, ending: ShutdownRequest, settings: OutputSettings) -> None:
    """Finish the running step, unless a second signal arrives."""
    closing = asyncio.ensure_future(running.process.close(finish=True))
    hurrying = asyncio.ensure_future(ending.hurried.wait())
    await asyncio.wait({closing, hurrying}, return_when=asyncio.FIRST_COMPLETED)
    if not closing.done():
        if not settings.json:
            output.say(translate("The robot decelerates along the path and stops now.", settings.language))
        await running.process.close()
    hurrying.cancel()
    await closing


async def _come_to_rest(running: Stack) -> None:
    """Stop on the path and wait for rest; give up on a machine without connection."""
    if running.controller.state.mode not in _MOVING:
        return
    with suppress(MayaError, TimeoutError):
        report = await running.service.stop()
        async with asyncio.timeout(report.duration + 5.0):
            async for state in running.controller.watch():
                if state.mode not in _MOVING:
                    return


ROSBRIDGE_PORT = 9090
"""The default port of rosbridge."""

MEMORY = "memory"
"""The name of the journal in memory."""


_FILES = 24
"""Approximate number of files that the service opens besides its connections: journal, locks, listeners, workers."""


class UpOptions(NamedTuple):
    """Options of `maya up`; `table` is a job file whose parts stand on the twin's table.

    `truth` is as in `configure.truth_of_twin`. `journal` is the file of the queue, "memory" for none, None for the
    default file; with `finish`, the running step is finished before this program ends. `rosbridge` is the port of that
    endpoint, None for none. `take_over` takes the controller from another program that owns it. `coms` also starts
    `maya coms`, which needs that endpoint. `show` opens the dashboard in the default browser. With `ros2` the robot
    appears in a graph of ROS 2.
    """

    address: str = SIM
    speed: float | None = None
    port: int = PORT
    seed: int | None = None
    truth: str | None = None
    table: str | None = None
    skip_home: bool = False
    journal: str | None = None
    finish: bool = False
    remote: RemoteAccess = RemoteAccess()
    rosbridge: int | None = None
    take_over: bool = False
    coms: bool = False
    show: bool = False
    ros2: Ros2Options | None = None


class _Robot(NamedTuple):
    """The robot to run: address, speed of its clock, the twin and the parts on its table, homing, and the owner.

    With `skip_home` it uses a stored homing; with `take_over` it takes the controller from another program. Taught
    places are stored in the file `places`, the queue in the file `journal`, None for memory. Clients may change
    `config_file`, from which `config` was read.
    """

    config: Config
    address: str
    speed: float
    seed: int
    truth: TrueConstants | None
    parts: dict[str, Point]
    skip_home: bool
    places: Path
    config_file: Path
    journal: Path | None
    take_over: bool


class _UpListeners(NamedTuple):
    """The listeners: HTTP on loopback, HTTP for other computers, and those of the graph of ROS; None if absent."""

    near: socket.socket
    far: ListeningSocket | None
    graph: EndpointOptions | None


def up(options: UpOptions, settings: OutputSettings) -> int:
    """Run until Ctrl-C or SIGTERM; then come to rest, close the connection, and remove the runtime file.

    Raises the errors of the start: `AlreadyRunning`, `AddressInUse`, `StorageInUse`, `ConnectFailed` and related
    errors.
    """
    reserve_descriptors(own=_FILES)
    prompt_loop()
    options.remote.check()
    config = configuration(settings)
    address = target_address(options.address, config.controller.address)
    speed = clock_factor(options.speed, address)
    if options.rosbridge is not None or options.ros2 is not None:
        config = _configured(config, speed)
    require_twin(address, "maya up", seed=options.seed, truth=options.truth, table=options.table)
    seed = options.seed or 0
    truth = truth_of_twin(options.truth, config, seed)
    parts = on_the_table(options.table, config, settings)
    places, file, journal = taught_places(settings), config_file(settings), journal_file(options.journal)
    robot = _Robot(
        config, address, speed, seed, truth, parts, options.skip_home, places, file, journal, options.take_over
    )
    clock: Callable[[], asyncio.AbstractEventLoop] | None = (lambda: ScaledLoop(speed)) if address == SIM else None
    with runtime.claimed(), log.kept(), ExitStack() as held:
        near = held.enter_context(bound_socket(options.port))
        far = options.remote.listener()
        if far is not None:
            held.enter_context(far.socket)
        graph = held.enter_context(graph_at(options.rosbridge, options.ros2, journal, options.remote))
        if graph is not None and graph.listener is not None and options.coms:
            from maya_un.cli.coms.run import coms_beside

            held.enter_context(coms_beside(url_of(graph.listener), config.coms, settings.language))
        run(_serve(robot, options, _UpListeners(near, far, graph), settings), clock)
    return output.DONE


def ros2_of(namespace: str, remaps: Sequence[str] = ()) -> Ros2Options:
    """Return the domain that $ROS_DOMAIN_ID names, 0 without it, a namespace, and remappings like "/tf:=/left/tf".

    Raises `InvalidValue`.
    """
    from maya_un.edges import DOMAIN, ROS_NAME, Ros2Options, ros2_domain, ros2_namespace

    domain = ros2_domain(os.environ.get(DOMAIN) or "0")
    ros2_namespace(namespace, "--ros-namespace")
    remappings: dict[str, str] = {}
    for remap in remaps:
        found = re.fullmatch(rf"({ROS_NAME}):=({ROS_NAME})", remap)
        if found is None:
            raise InvalidValue(key="--ros-remap", value=remap, reason="it must be two names of ROS, FROM:=TO")
        remappings["/" + found[1].strip("/")] = found[2]
    return Ros2Options(domain, namespace, remappings)


def journal_file(named: str | None) -> Path | None:
    """Return the file of the queue: by default that in the state folder, None for "memory"."""
    if named == MEMORY:
        return None
    if named is None:
        return own_queue_file()
    require_place(Path(named))
    return Path(named)


async def _serve(robot: _Robot, options: UpOptions, listeners: _UpListeners, settings: OutputSettings) -> None:
    keep_quiet(asyncio.get_running_loop())
    metrics = Metrics()
    async with _running(robot) as running:
        require_users(kept=running.access.callers.kept, listen=options.remote.listen)
        running.controller.events.heard_by(metrics.happened)
        running.controller.events.heard_by(log.note_event)
        running.controller.tap(metrics.timer(robot.speed))
        refusal = await _refusal_to_skip_home(running) if robot.skip_home else None
        bridge = _bridge(running, settings)
        addresses = options.remote.addresses(listeners.far)
        app = create_app(bridge, options.remote.edge(), metrics, addresses)
        add_dashboard(app, robot.config.camera.url)
        ending = ShutdownRequest(finish=options.finish)
        far = () if listeners.far is None else (listeners.far,)
        beside = partial(_beside, running, bridge, listeners.graph, robot.speed, coms=options.coms)
        async with served(app, listeners.near, *far, beside=beside) as url, _looked_after(robot.speed, metrics):
            with ending.listening():
                controller = None if robot.address == SIM else parse(robot.address)
                config = str(robot.config_file.resolve()) if robot.config_file.exists() else ""
                runtime.publish(runtime.Running(url, os.getpid(), controller, config))
                greet(_greeting(running, robot, url, listeners, refusal), settings)
                tell("READY=1")
                if options.show:
                    show_page(url, partial(_not_shown, url, settings))
                await ending.asked.wait()
                tell("STOPPING=1")
                await brought_to_rest(running, ending, settings)


@asynccontextmanager
async def _running(robot: _Robot) -> AsyncIterator[Stack]:
    """Assemble the stack on its journal, and close the journal last; remove a new journal if the start fails."""
    new = robot.journal is not None and not robot.journal.exists()
    started = False
    try:
        with staffed(robot.config) as staff:
            async with (
                storage(robot.journal, robot.config.storage) as kept,
                stack(
                    robot.config,
                    robot.address,
                    seed=robot.seed,
                    parts=robot.parts,
                    truth=robot.truth,
                    speed=robot.speed,
                    take_over=robot.take_over,
                    places=robot.places,
                    config_file=robot.config_file,
                    journal=kept.journal,
                    calendar=dates,
                    users=kept.users,
                    recordings=store(robot.config.recorder),
                    staff=staff,
                ) as running,
            ):
                started = True
                yield running
    finally:
        if robot.journal is not None and new and not started:
            remove_new(robot.journal)


@asynccontextmanager
async def _looked_after(speed: float, metrics: Metrics) -> AsyncIterator[None]:
    """Measure the lag of the running loop, and send watchdog messages to systemd."""
    tasks = [asyncio.create_task(metrics.watch_loop(speed)), asyncio.create_task(stay_alive(speed))]
    try:
        yield
    finally:
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)


@asynccontextmanager
async def _beside(
    running: Stack, bridge: Bridge, graph: EndpointOptions | None, speed: float, *, coms: bool
) -> AsyncIterator[None]:
    """Serve the graph of ROS beside HTTP, and watch the fleet beside `maya coms`, if requested."""
    async with AsyncExitStack() as opened:
        if graph is not None:
            from maya_un.edges import edge

            await opened.enter_async_context(edge("ros").endpoint(running, bridge, graph, speed=speed))
            if coms:
                await opened.enter_async_context(fleet_beside(running.service.fleet))
        yield


def _configured(config: Config, speed: float) -> Config:
    from maya_un.edges import edge

    return edge("ros").configured(config, speed)


def _not_shown(url: str, settings: OutputSettings) -> None:
    if not settings.json:
        output.say(translate("No browser opens on this computer. Open {url} yourself.", settings.language, url=url))


def _greeting(running: Stack, robot: _Robot, url: str, at: _UpListeners, refusal: MayaError | None) -> StartupBanner:
    remote = None if at.far is None else at.far.url
    graph = at.graph
    rosbridge = None if graph is None or graph.listener is None else url_of(graph.listener)
    domain = None if graph is None or graph.ros2 is None else graph.ros2.domain
    queue = running.service.queue.view()
    return StartupBanner(url, remote, robot.address, robot.speed, robot.journal, queue, refusal, rosbridge, domain)


def _bridge(running: Stack, settings: OutputSettings) -> Bridge:
    return Bridge(
        asyncio.get_running_loop(),
        running.service,
        gate=running.gate,
        callers=running.access.callers,
        journal=running.journal,
        config_file=None if settings.config is None else Path(settings.config),
    )


async def _refusal_to_skip_home(running: Stack) -> MayaError | None:
    """Use the homing stored in the controller; return the error that refuses it, or None."""
    try:
        await running.controller.skip_home()
    except MayaError as refusal:
        return refusal
    return None
