"""Draws a flame graph of a profile: `scripts/flame_graph.py STACKS PICTURE TITLE`.

STACKS is the output of `py-spy record -f raw -o STACKS -- python PROGRAM`. Each box is a function. Its width is the
share of processor time of the function and of all that it calls. The boxes below it are the functions that it calls.
The event loop and the start of the program are left out: the first row has the tasks and callbacks of the loop, and
the work of other threads. The option `--gil` of py-spy leaves out threads that wait.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator
from dataclasses import dataclass, field
from html import escape
from pathlib import Path

WIDTH, ROW, MARGIN, TOP = 1180, 17, 10, 76
LEAST = 0.004
"""Least share of a box that is drawn."""

LOOP = ("Handle._run ", "run_virtual ", "_run (asyncio/events")
"""Frames of the event loop; what follows the last one is drawn."""

THREAD = "Thread.run (threading"
"""Frame with which a thread without an event loop begins."""

LAYERS = (
    ("dmc41x3/twin", "#7fb2e5", "twin of the controller"),
    ("maya_un/machine", "#a9cdea", "mechanics of the twin"),
    ("maya_un/motion", "#f2a65a", "planning and proof"),
    ("maya_un/kinematics", "#f6c28b", "kinematics"),
    ("dmc41x3/", "#7cc6b0", "wire, language and driver"),
    ("maya_ros/", "#e7b7a0", "ROS"),
    ("maya_un/controller", "#a3c76d", "controller layer"),
    ("maya_un/http", "#d8a7d6", "HTTP and stream"),
    ("maya_un/coms", "#b5d3a8", "link to supervisors"),
    ("maya_un/", "#c3b1e1", "robot, process and service"),
    ("numpy", "#e8e0a0", "numpy"),
    ("", "#d5d5d5", "Python and libraries"),
)
"""The colours of functions, by the first of these texts that is in the path of their module."""


@dataclass(slots=True)
class Call:
    """A function and what it calls; `samples` counts the samples in which it was running."""

    samples: int = 0
    calls: dict[str, Call] = field(default_factory=dict[str, "Call"])


@dataclass(frozen=True, slots=True)
class Box:
    """A rectangle of the picture: its place, its width, its row, the function, and its share of the time."""

    x: float
    width: float
    row: int
    function: str
    share: float


def calls_of(stacks: str) -> Call:
    """Return the tree of calls of a profile."""
    root = Call()
    for line in stacks.splitlines():
        stack, _, count = line.rpartition(" ")
        frames = [re.sub(r":\d+\)", ")", frame) for frame in stack.split(";") if "importlib" not in frame]
        loops = [place for place, frame in enumerate(frames) if frame.startswith(LOOP)]
        begins = loops or [place for place, frame in enumerate(frames) if frame.startswith(THREAD)]
        if begins:
            at = root
            at.samples += int(count)
            for frame in frames[begins[-1] + 1 :]:
                at = at.calls.setdefault(frame, Call())
                at.samples += int(count)
    return root


def boxes(root: Call) -> Iterator[Box]:
    """Yield the boxes of all calls that are wide enough."""
    waiting = [(root, float(MARGIN), float(WIDTH - 2 * MARGIN), 0)]
    while waiting:
        caller, x, width, row = waiting.pop()
        for function, call in sorted(caller.calls.items(), key=lambda one: -one[1].samples):
            if call.samples >= LEAST * root.samples:
                part = width * call.samples / caller.samples
                yield Box(x, part, row, function, call.samples / root.samples)
                waiting.append((call, x, part, row + 1))
                x += part


def colour(function: str) -> str:
    """Return the colour of a function."""
    return next(colour for text, colour, _ in LAYERS if text in function)


def picture(stacks: str, title: str) -> str:
    """Return the picture as SVG."""
    drawn = list(boxes(calls_of(stacks)))
    height = TOP + ROW * (1 + max(box.row for box in drawn)) + MARGIN
    font = 'font-family="DejaVu Sans, sans-serif" font-size="11"'
    lines = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {height}" {font}>',
        f'<rect width="{WIDTH}" height="{height}" fill="#ffffff"/>',
        f'<text x="{MARGIN}" y="20" font-size="14" font-weight="bold">{escape(title)}</text>',
        *legend({colour(box.function) for box in drawn}),
        *(text for box in drawn for text in _drawn(box)),
        "</svg>",
    ]
    return "\n".join(lines) + "\n"


def legend(used: set[str]) -> Iterator[str]:
    """Yield the colours that are used, with their meanings."""
    x, y = MARGIN, 31
    for _, fill, meaning in LAYERS:
        if fill in used:
            width = 30 + round(6.6 * len(meaning))
            if x + width > WIDTH:
                x, y = MARGIN, y + ROW
            yield f'<rect x="{x}" y="{y}" width="11" height="11" fill="{fill}"/>'
            yield f'<text x="{x + 15}" y="{y + 10}">{meaning}</text>'
            x += width


def _drawn(box: Box) -> Iterator[str]:
    y = TOP + box.row * ROW
    place = f'x="{box.x:.1f}" y="{y}" width="{max(box.width - 0.6, 0.3):.1f}" height="{ROW - 1}"'
    told = f"<title>{escape(box.function)}: {box.share:.1%}</title>"
    yield f'<rect {place} fill="{colour(box.function)}">{told}</rect>'
    name, room = box.function.partition(" (")[0], int((box.width - 4) / 6.3)
    if room >= 3:
        shown = name if len(name) <= room else f"{name[: room - 1]}…"
        yield f'<text x="{box.x + 2:.1f}" y="{y + 12}">{escape(shown)}</text>'


def main() -> None:
    stacks, target, title = sys.argv[1:]
    Path(target).write_text(picture(Path(stacks).read_text(encoding="utf-8"), title), encoding="utf-8")


if __name__ == "__main__":
    main()
