"""After any requests in any order: at most one caller drives, and the event log alone shows who.

A model of the rules runs next to the lease; it is written from the rules and shares no code with it. A running drive
issues a command every half second. Each command is checked against the log: its caller drove at that instant.
"""

from __future__ import annotations

import asyncio
from dataclasses import dataclass, field

from hypothesis import given, settings
from hypothesis import strategies as st

from maya_un.errors import LeaseHeld, LeaseLost, LeaseNeeded, MayaError
from maya_un.events import EventLog
from maya_un.process.lease import LINGER, OFFER, ControlLease, cancel_once
from tests.judge.drivers import driver_at, spans
from tests.virtual_time import elapse

NAMES = ("ann", "bob", "ros")
TICK = 0.5

HOLDER = "whoever holds it"

names = st.sampled_from([*NAMES, HOLDER, HOLDER])
pauses = st.sampled_from([0.9, 2.5, 4.9, 5.2, 9.9, 10.2, 61.0])
patiences = st.sampled_from([5.0, 10.0, 100.0])
steps = st.lists(
    st.one_of(
        st.tuples(st.just("take"), names, patiences, st.booleans()),
        st.tuples(st.just("renew"), names),
        st.tuples(st.just("release"), names),
        st.tuples(st.just("offer"), names, names),
        st.tuples(st.just("drop"), names),
        st.tuples(
            st.just("drive"),
            names,
            st.sampled_from(["lease", "direct", "job"]),
            st.sampled_from([3.0, 15.0, 90.0, 90.0]),
        ),
        st.tuples(st.just("wait"), pauses),
    ),
    min_size=5,
    max_size=60,
)


@dataclass
class Drive:
    """A running drive: a command under a lease, a direct one, or a job; and its end."""

    name: str
    kind: str
    until: float


@dataclass
class Model:
    """The rules again: the holder of a lease until a time, and the running drives."""

    holder: str = ""
    until: float = 0.0
    patience: float = 0.0
    drives: list[Drive] = field(default_factory=list[Drive])

    def pass_to(self, now: float) -> None:
        """Let time pass: drives end, and a lease that was not renewed expires."""
        if self.holder and now > self.until:
            self.end()
        self.drives = [drive for drive in self.drives if drive.until > now]

    def end(self) -> None:
        """End the lease; drives under it end with it."""
        self.holder = ""
        self.drives = [drive for drive in self.drives if drive.kind != "lease"]

    def going(self, *kinds: str) -> set[str]:
        """Return whose these are."""
        return {drive.name for drive in self.drives if drive.kind in kinds}

    def free_for(self, name: str, implicit: str) -> bool:
        """Tell whether `name` may drive without a lease; `implicit` is who is seen to while nobody holds it."""
        if self.holder:
            return self.holder == name
        return not self.going("direct", "job") or implicit == name

    def take(self, name: str, now: float, patience: float) -> None:
        """Give it to `name`; drives of others end, jobs excepted, and all drives under a lease."""
        self.holder, self.patience, self.until = name, patience, now + patience
        self.drives = [one for one in self.drives if one.kind == "job" or (one.kind == "direct" and one.name == name)]


class Scene:
    """A lease, its model, and everybody's lease ids and tasks."""

    def __init__(self) -> None:
        self.events = EventLog(asyncio.get_running_loop().time)
        self.lease = ControlLease(self.events)
        self.model = Model()
        self.ids: dict[str, str] = {}
        self.tasks: list[asyncio.Task[None]] = []
        self.commands: list[tuple[str, int]] = []

    @property
    def now(self) -> float:
        return asyncio.get_running_loop().time()

    async def carried(self, name: str, kind: str, lease: str, seconds: float) -> None:
        """Drive, as the gate and the queue do: in a task of its own, which is cancelled once the lease is lost."""
        with self.lease.driving(name, name, lease, direct=kind != "job") as drive:
            if kind == "job":
                await elapse(seconds)
                return
            work = asyncio.ensure_future(self.commanded(name, seconds))
            drive.carry(work)
            try:
                await asyncio.wait({work})
            finally:
                cancel_once(work)

    async def commanded(self, name: str, seconds: float) -> None:
        """Command the robot again and again."""
        end = self.now + seconds
        while self.now < end:
            self.commands.append((name, len(self.events)))
            await elapse(min(TICK, end - self.now))

    def take(self, name: str, patience: float, force: bool) -> None:
        """Take it; the model decides whether this is allowed."""
        model, offered = self.model, self.lease.offered_to == name
        others = model.going("direct") - {name}
        may = force or (not others and (offered or not model.holder))
        try:
            self.ids[name] = self.lease.take(name, name, patience=patience, force=force).id
            assert may, f"{name} took it from {model}"
            model.take(name, self.now, patience)
        except LeaseHeld:
            assert not may, f"{name} did not get it from {model}"

    def renew(self, name: str) -> None:
        """Renew with whatever lease one had last."""
        self._shown(name, lambda lease: self.lease.renew(lease, name))
        if self.model.holder == name:
            self.model.until = self.now + self.model.patience

    def release(self, name: str) -> None:
        """Give it back."""
        self._shown(name, lambda lease: self.lease.release(lease, name))
        if self.model.holder == name:
            self.model.end()

    def drop(self, name: str) -> None:
        """Take somebody's rights."""
        self.lease.drop(name, "removed")
        if self.model.holder == name:
            self.model.end()

    async def drive(self, name: str, kind: str, seconds: float) -> None:
        """Begin to drive, and go on with the next step meanwhile."""
        model, lease = self.model, self.ids.get(name, "") if kind == "lease" else ""
        kind = kind if lease or kind != "lease" else "direct"
        may = model.holder == name if lease else model.free_for(name, self.seen)
        task = asyncio.ensure_future(self.carried(name, kind, lease, seconds))
        await elapse(0.0)
        if may:
            assert not task.done(), f"{name} could not drive with {model}"
            self.tasks.append(task)
            model.drives.append(Drive(name, kind, self.now + seconds))
            if lease:
                model.until = self.now + model.patience
        else:
            assert isinstance(task.exception(), MayaError), f"{name} drove with {model}"

    def _shown(self, name: str, work: object) -> None:
        assert callable(work)
        try:
            work(self.ids.get(name, ""))
            assert self.model.holder == name
        except (LeaseLost, LeaseHeld, LeaseNeeded):
            assert self.model.holder != name

    async def do(self, step: tuple[object, ...]) -> None:
        """Do one step, and compare."""
        match tuple(self.model.holder or NAMES[0] if part == HOLDER else part for part in step):
            case ("take", str(name), float(patience), bool(force)):
                self.take(name, patience, force)
            case ("renew", str(name)):
                self.renew(name)
            case ("release", str(name)):
                self.release(name)
            case ("drop", str(name)):
                self.drop(name)
            case ("offer", str(name), str(by)):
                self.lease.offer(name, by)
            case ("drive", str(name), str(kind), float(seconds)):
                await self.drive(name, kind, seconds)
            case ("wait", float(seconds)):
                await elapse(seconds)
            case _:
                raise AssertionError(step)
        # Half a tick off every due time, so that which of two at the same instant comes first is nobody's question.
        await elapse(0.0137)
        self.model.pass_to(self.now)
        self.compare()

    def compare(self) -> None:
        """Hold the lease against the model, and the model against the log."""
        holder = self.lease.holder
        explicit = holder.name if holder is not None and not holder.implicit else ""
        assert explicit == self.model.holder
        assert len(self.model.going("direct")) <= 1
        going = self.model.going("direct", "job")
        if going and not explicit:
            assert self.seen in going
        for name in NAMES:
            assert self.lease.may_begin(name) is self.model.free_for(name, self.seen)

    @property
    def seen(self) -> str:
        """The driver in the event log."""
        return "" if self.lease.holder is None else self.lease.holder.name

    async def end(self) -> None:
        """Let everything end; nobody drives then."""
        await asyncio.gather(*self.tasks)
        await elapse(max(LINGER, OFFER, 100.0) + 1.0)
        assert self.lease.holder is None
        self.lease.close()


@settings(max_examples=max(300, settings().max_examples))
@given(steps)
async def test_at_most_one_caller_drives_and_the_log_names_him(script: list[tuple[object, ...]]) -> None:
    scene = Scene()
    for step in script:
        await scene.do(step)
    await scene.end()
    log = spans(scene.events.since(0))
    wrong = [(name, seq) for name, seq in scene.commands if driver_at(log, seq) != name]
    assert wrong == []
