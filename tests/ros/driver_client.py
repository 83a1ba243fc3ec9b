"""The test's side of `driver.py`: a node in another process that obeys the test."""

from __future__ import annotations

import json
from collections.abc import Callable
from threading import Condition, Thread
from time import monotonic
from typing import Any

from tests.ros.programs import Program

Message = dict[str, Any]


class Feed:
    """Messages on a topic, or feedback of a goal, in order."""

    def __init__(self) -> None:
        self.messages: list[Message] = []
        self._news = Condition()

    def add(self, message: Message) -> None:
        """Take a message in."""
        with self._news:
            self.messages.append(message)
            self._news.notify_all()

    def until(self, wanted: Callable[[Message], object] = bool, within: float = 40.0, after: int = 0) -> Message:
        """Return the first message that is wanted, of those `after` so many; fails where none comes for so long [s]."""
        end = monotonic() + within
        looked = after
        with self._news:
            while True:
                for message in self.messages[looked:]:
                    if wanted(message):
                        return message
                looked = max(looked, len(self.messages))
                if not self._news.wait(end - monotonic()):
                    raise AssertionError(f"no such message among {len(self.messages)}, the last: {self.messages[-5:]}")


class Goal:
    """A goal of an action, as its client sees it."""

    def __init__(self, driver: Driver, name: str) -> None:
        self._driver = driver
        self._name = name
        self.feedback = Feed()
        self.status = Feed()
        """{"state": GoalStatus, "text": words} whenever it changes."""
        self._ended = Feed()

    def cancel(self) -> None:
        """Ask for its end."""
        self._driver.ask("cancel", goal=self._name)

    def ended(self, within: float = 40.0) -> tuple[int, Message]:
        """Return how it ended, as a GoalStatus, and its result."""
        told = self._ended.until(within=within)
        return int(told["outcome"]), told["result"]

    def hear(self, told: Message) -> None:
        """Take in what the driver tells of it."""
        feed = {"feedback": self.feedback, "status": self.status, "ended": self._ended}[told["what"]]
        feed.add(told["message"] if told["what"] != "ended" else told)


class Driver:
    """A node that publishes, listens, calls and sends goals; it may be used by several threads."""

    def __init__(self, program: Program) -> None:
        self.program = program
        self._asked = 0
        self._answers = Feed()
        self._topics: dict[str, Feed] = {}
        self._goals: dict[str, Goal] = {}
        self.name = str(json.loads(program.until('"ready"'))["ready"])
        Thread(target=self._listen, daemon=True).start()

    def ask(self, op: str, within: float = 40.0, **fields: Any) -> Any:
        """Have something done and return what it gives; raises `RefusedError` with the driver's words."""
        number = self._send(op, fields)
        answer = self._answers.until(lambda told: told["id"] == number, within)
        if "error" in answer:
            raise RefusedError(answer["error"])
        return answer.get("value")

    def subscribe(self, topic: str, kind: str = "") -> Feed:
        """Listen to a topic; without a type, to one that somebody publishes."""
        if topic not in self._topics:
            self._topics[topic] = Feed()
            self.ask("subscribe", topic=topic, type=kind)
        return self._topics[topic]

    def publish(self, topic: str, kind: str, message: Message, readers: int = 1, *, latch: bool = False) -> None:
        """Publish a message, when so many listen."""
        self.ask("publish", topic=topic, type=kind, message=message, readers=readers, latch=latch)

    def call(self, service: str, request: Message | None = None, within: float = 40.0) -> Message:
        """Return the answer of a service, whose type is asked of it; waits for it to be there."""
        return self.ask("call", within, service=service, request=request or {})

    def do(self, action: str, kind: str, goal: Message | None = None) -> Goal:
        """Send a goal, when the action's server is there."""
        self._asked += 1
        name = f"goal{self._asked}"
        self._goals[name] = Goal(self, name)
        self.ask("goal", goal=name, action=action, type=kind, message=goal or {})
        return self._goals[name]

    def close(self) -> None:
        """End the node."""
        self.program.close()

    def _send(self, op: str, fields: Message) -> int:
        self._asked += 1
        self.program.write(json.dumps({"id": self._asked, "op": op, **fields}))
        return self._asked

    def _listen(self) -> None:
        for line in self.program.follow():
            if line.startswith('{"'):
                self._take(json.loads(line))

    def _take(self, told: Message) -> None:
        if "topic" in told:
            self._topics[told["topic"]].add(told["message"])
        elif "goal" in told:
            self._goals[told["goal"]].hear(told)
        elif "id" in told:
            self._answers.add(told)


class RefusedError(AssertionError):
    """The driver could not do it; its words say why."""
