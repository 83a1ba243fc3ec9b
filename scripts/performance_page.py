"""The page docs/explanation/performance.md: every figure comes from stored runs of `scripts/bench`."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import groupby
from textwrap import fill

from performance_results import (
    BARE,
    CHANCE,
    COMPILED,
    GOALS,
    OURS,
    SERVICES,
    WORSE,
    Compared,
    Comparison,
    Computer,
    Growth,
    Motion,
    Row,
    Run,
    number,
    read,
    read_comparison,
)

CLOSE = 0.2
"""Two runs should agree on a ratio within this share."""

SUBJECTS = {
    "kinematics": "Kinematics",
    "timing": "Timing of a motion",
    "stream": "States for many readers",
    "queue": "A durable queue",
    "command": "One command line",
}
"""The subjects in the page's order, and their headings."""

INTRODUCTION = """
This page compares Maya with the programs that a user would pick instead of one of its parts. All programs do the same
work in one run. A figure counts only if the program gives the same answer as Maya. The last section compares Maya with
its own goals. The figures and the pictures are made from the files in `benchmarks/results`.
"""

REPEAT = """
The first command installs the other programs in `.venv-peers`, at the versions of `requirements-peers.lock`. It needs
the network, and a quarter of an hour. `scripts/bench --peers --quick --output FILE` takes two minutes, and measures
fewer sizes. The file keeps the last two runs.
"""

RATIOS = """
The ratio is the cost of a program divided by the cost of Maya. Above 1 Maya is faster, below 1 Maya is slower. The
programs take turns: each round measures all of them once and gives a ratio. The table has the median of these ratios.
The last column is the greatest difference from the answer of Maya.
"""

DIFFERENCES = {
    "kinematics": """
Maya has formulas for its own mechanism, and works only for Maya. The other programs work for every robot that is a
chain of joints. Maya's two lines are not a chain. A user of these programs models one line: the boom turns, line b
turns at its anchor, and line b gets longer. The length of line c is the distance from its anchor. In the forward
direction the law of cosines gives the angle of line b. These steps are written in Python and count for each program.
In the inverse direction the programs search by iteration from a fixed guess. pinocchio has no inverse kinematics of its
own: the benchmark uses Newton steps, as in the manual of pinocchio.
""",
    "timing": """
All programs get the same limits of speed and acceleration. The answer is the duration, and it may differ by 2 %. The
other programs must also begin and end at the right place and keep the limits of speed. ruckig gets the end points. In
this move the boom is always the slowest axis, because ruckig limits each axis alone, and Maya limits all axes along one
straight line. toppra gets a spline through the end points, or through 100 places of the straight line. Maya computes
more: its result is a list of segments that the controller can carry out. The row "Maya, path proven" also has the
check of the whole path against the workspace. The other programs have no such check. ruckig can also limit the jerk and
start from any motion; the benchmark does not compare that.
""",
    "stream": """
Both servers use uvicorn. The plain server sends the same text as Maya, with one call of the framework for each client,
as its manual shows. The cost is CPU time of the server for one state at one reader. Every reader must receive at least
90 % of the states. Maya's stream also offers topics, a rate for each reader, and limits for slow readers.
""",
    "queue": """
Both programs use SQLite and force every job to the disk before the call returns. Each queue is closed and opened again,
and must then hold all jobs. One submitter waits for each job. Sixteen submitters work at the same time. With
persist-queue they are threads. With Maya they are tasks, whose jobs share a commit. Maya's journal also stores the
options, the owner and the state of a job.
""",
    "command": """
Each command asks its own running server for the state. bluesky-queueserver needs Redis, which the benchmark starts on
this computer. The row `python -c pass` is a Python that does nothing. CPU time contains neither the servers nor other
processes of the computer.
""",
}
"""The differences between the programs, for each subject."""

SIZES = """
A job has at most 3 000 tasks. A job above 500 tasks repeats its steps. The cost of a dry run contains the homing. More
work is a queue of jobs: the second table shows the cost of one more durable job while up to 100 000 jobs wait. The cost
for readers is CPU time of the server for one state at one reader. The cost for axes is CPU time for each second of
motion. The axes belong to the twin, which no other
program here replaces.
"""

LEAST = """
The least time comes from another program, `tests/lower_bound.py`, which knows the limits of the axes and the shape of
the way. *Carried out* is how long the axes of the twin moved. *Each axis alone* is the time without coordination and
with a stop at every waypoint; the gripper then follows another way. The controller accelerates along a path in
steps. Within a step an axis accelerates harder than its limit, and on average it keeps the limit. So a motion can take
slightly less than the least time.
"""


GOALS_TEXT = """
`scripts/bench --against FOLDER --output FILE` measures two checkouts of Maya in turn. *Before* is the commit {before},
*now* is the commit {after}, and *compiled* is the same commit with compiled modules (`MAYA_COMPILE=1 pip install .`).
A figure is the best of all rounds. One that is printed bold misses its goal. The figures are from {date}: {machine}.
"""

SERVICES_TEXT = """
These benchmarks start programs that serve others. *Before* is the commit {before}, *now* is the commit {after}. The
figures are from {date}: {machine}. The table has the best round of each commit. The list below it has the best sample
of all rounds, or the median of all samples if the benchmark compares medians. Most figures are times by the clock, so
they also contain what else the computer did. The bare programs run nothing of Maya: a difference between their two
times shows how uncertain the others are.
"""

MISSED_TEXT = """
Decisions [69](../decisions/0069-compiled-modules-are-optional.md) and
[71](../decisions/0071-limits-of-the-speed.md) give the reasons why the other goals are not reached.
"""


CHANCE_TEXT = """
These are more than {limit:.0%} greater, but two equal programs can differ as much: a rank test (Mann-Whitney) gives
such a difference a probability of {chance:.0%} or more. It stands behind each figure:
"""


def page() -> str:
    """Return the page."""
    runs = read()
    goals = _goals(read_comparison(GOALS), read_comparison(COMPILED), read_comparison(SERVICES))
    return "\n".join([*_lines(runs[-1], runs[:-1]), *goals]) + "\n"


def _lines(run: Run, older: Sequence[Run]) -> Iterator[str]:
    yield "# Performance\n"
    yield _wrapped(INTRODUCTION)
    yield "\n## Repeat it\n"
    yield "```sh\nscripts/bench --peers   # measures everything, and stores the run"
    yield "scripts/docs            # makes this page and its pictures\n```\n"
    yield _wrapped(REPEAT)
    yield "\n## Conditions\n"
    yield from _conditions(run)
    yield "\n## Beside other programs\n"
    yield "![Cost of the same work, as a multiple of the cost of Maya](../images/performance-peers.svg)\n"
    yield _wrapped(RATIOS)
    for subject, found in groupby(run.rows, key=lambda row: row.subject):
        yield from _subject(subject, list(found))
    for program, reason in run.left_out.items():
        yield f"\n{program} is left out: {reason}."
    yield from _slower(run)
    yield from _growth(run)
    yield from _limit(run.motions)
    yield from _repeated(run, older)


def _wrapped(text: str) -> str:
    return fill(" ".join(text.split()), 120, break_long_words=False, break_on_hyphens=False)


def _conditions(run: Run) -> Iterator[str]:
    ran = "as compiled code" if run.computer.compiled else "as Python source, not compiled"
    yield _wrapped(
        f"The figures are from {run.date}: {_machine(run.computer)}. Maya ran {ran}. Kinematics, timing, stream and "
        "twin are measured in CPU time of the benchmark's own processes, which leaves out other programs on the "
        "computer. The queue is measured by the clock, because it waits for the disk."
    )
    versions = ", ".join(f"{name} {number}" for name, number in run.versions.items())
    yield "\n" + _wrapped(f"Versions: {versions}.")


def _machine(computer: Computer) -> str:
    return (
        f"{computer.processor}, {computer.cores} cores, {computer.system}, Python {computer.python}, load "
        f"{_load(computer)} at the start (means of 1, 5 and 15 minutes)"
    )


def _load(computer: Computer) -> str:
    return " / ".join(f"{value:g}" for value in computer.load)


def _subject(subject: str, rows: Sequence[Row]) -> Iterator[str]:
    yield f"\n### {SUBJECTS[subject]}\n"
    yield "| work | program | best | median | worst | ratio | difference |\n|---|---|---|---|---|---|---|"
    yield from map(_row, rows)
    yield "\n" + _wrapped(DIFFERENCES[subject])


def _row(row: Row) -> str:
    if row.error:
        return f"| {row.work} | {row.program} | error: {row.error} | | | | |"
    assert row.difference is not None
    costs = " | ".join(f"{number(cost)} {row.unit}" for cost in (row.best, row.median, row.worst))
    difference = "none" if row.difference == 0.0 else f"{row.difference:.1g} {row.answered_in}"
    return f"| {row.work} | {row.program} | {costs} | {number(row.ratio)} | {difference} |"


def _slower(run: Run) -> Iterator[str]:
    yield "\n## Where Maya is slower\n"
    slower = [(row.ratio, row) for row in run.rows if row.ratio is not None and row.ratio < 1.0 and row.program != BARE]
    for ratio, row in sorted(slower, key=lambda one: one[0]):
        yield f"- {_capital(row.work)}: Maya needs {number(1.0 / ratio)} times as much as {row.program}."
    if not slower:
        yield "In this run no other program was faster than Maya at the same work."


def _capital(text: str) -> str:
    return text[0].upper() + text[1:]


def _growth(run: Run) -> Iterator[str]:
    yield "\n## Growth with the work\n"
    yield "![Cost over the size of the work](../images/performance-growth.svg)\n"
    yield _wrapped(SIZES)
    for subject, found in groupby(run.growth, key=lambda growth: growth.subject):
        yield from _sizes(subject, list(found))


def _sizes(subject: str, growth: Sequence[Growth]) -> Iterator[str]:
    programs = list(dict.fromkeys(one.program for one in growth))
    yield f"\n| {subject} | {' | '.join(f'{program} [{growth[0].unit}]' for program in programs)} |"
    yield f"|---|{'---|' * len(programs)}"
    costs = {(one.size, one.program): one.cost for one in growth}
    for size in dict.fromkeys(one.size for one in growth):
        cells = (number(costs[size, program]) if (size, program) in costs else "" for program in programs)
        yield f"| {number(size)} | {' | '.join(cells)} |"


def _limit(motions: Sequence[Motion]) -> Iterator[str]:
    yield "\n## Distance to the physical limit\n"
    yield "![Duration of motions, as a multiple of the least time](../images/performance-limit.svg)\n"
    yield _wrapped(LEAST)
    yield "\n| motion | least time | carried out | over the least time | each axis alone | off its way at most |"
    yield "|---|---|---|---|---|---|"
    for motion in motions:
        over = round(100.0 * (motion.carried_out / motion.least - 1.0), 1) + 0.0  # no -0.0
        times = f"{motion.least:.2f} s | {motion.carried_out:.2f} s | {over:.1f} % | {motion.alone:.2f} s"
        yield f"| {motion.name} | {times} | {1e3 * motion.off:.2f} mm |"


def _repeated(run: Run, older: Sequence[Run]) -> Iterator[str]:
    yield "\n## Two runs\n"
    if not older:
        yield "There is only one run so far."
        return
    before = older[-1]
    changes = dict(ratio_changes(before, run))
    far = {key: change for key, change in changes.items() if change > CLOSE}
    yield _wrapped(
        f"Another run is from {before.date}, on {before.computer.processor}, with the load {_load(before.computer)} at "
        f"its start. Of {len(changes)} ratios, {len(changes) - len(far)} differ by at most {CLOSE:.0%} between the two "
        f"runs. The difference is the greater ratio divided by the smaller one, less 1."
        + (" These differ more:" if far else "")
    )
    if far:
        yield ""
    for (work, program), change in far.items():
        yield f"- {_capital(work)}, {program}: {change:.0%}."


def ratio_changes(before: Run, after: Run) -> Iterator[tuple[tuple[str, str], float]]:
    """Yield work and program, and by how much the greater ratio of two runs is over the smaller one (0.1 is 10 %)."""
    old = {(row.work, row.program): row.ratio for row in before.rows}
    for row in after.rows:
        one = old.get((row.work, row.program))
        if one is not None and row.ratio is not None and row.program != OURS:
            yield (row.work, row.program), max(one, row.ratio) / min(one, row.ratio) - 1.0


def _goals(now: Comparison, compiled: Comparison, services: Comparison) -> Iterator[str]:
    yield "\n## Goals\n"
    yield _wrapped(_about(GOALS_TEXT, now))
    faster = {(case.benchmark, case.name): case for case in compiled.cases}
    yield from _reached_goals(now, faster)
    yield "\n### Services\n"
    yield _wrapped(_about(SERVICES_TEXT, services))
    yield from _reached_goals(services, {})


def _about(text: str, of: Comparison) -> str:
    return text.format(before=of.before, after=of.after, date=of.date, machine=_machine(of.computer))


def _reached_goals(now: Comparison, faster: Mapping[tuple[str, str], Compared]) -> Iterator[str]:
    """Yield a table of the cases with a goal, and how many reach it; `faster` has the cases with compiled modules."""
    yield f"\n| benchmark | work | goal | before | now |{' compiled |' if faster else ''}"
    yield f"|---|---|---|---|---|{'---|' if faster else ''}"
    cases = [case for case in now.cases if case.goal is not None]
    for case in cases:
        yield _goal(case) + (f" {_compiled(faster.get((case.benchmark, case.name)))} |" if faster else "")
    missed = [case for case in cases if case.missed and faster.get((case.benchmark, case.name), case).missed]
    yield "\n" + _wrapped(
        f"Of {len(cases)} goals, {len(cases) - len(missed)} are reached{', as source or compiled' if faster else ''}."
        + (f" {MISSED_TEXT}" if missed else "")
    )
    old = [case for case in now.cases if case.ratio is not None]
    worse = [case for case in now.cases if case.worse]
    scattered = [case for case in now.cases if case.greater and not case.worse]
    kept = len(old) - len(worse) - len(scattered)
    yield "\n" + _wrapped(
        f"Of the {len(old)} figures that both commits have, with and without a goal, {kept} are at most "
        f"{WORSE - 1.0:.0%} worse than before." + (" These are worse:" if worse else "")
    )
    yield from _changes(worse)
    if scattered:
        yield "\n" + _wrapped(CHANCE_TEXT.format(limit=WORSE - 1.0, chance=CHANCE))
    yield from _changes(scattered)


def _changes(cases: Sequence[Compared]) -> Iterator[str]:
    if cases:
        yield ""
    for case in cases:
        chance = "" if case.worse else f" ({case.chance:.0%})"
        yield (
            f"- {case.benchmark}, {case.name}: {_figure(case.before, case)} before, {_figure(case.after, case)} "
            f"now{chance}."
        )


def _goal(case: Compared) -> str:
    before, now = _reached(case.reached_before, case), _reached(case.reached, case)
    return f"| {case.benchmark} | {case.name} | {_limit_of(case)} | {before} | {now} |"


def _compiled(case: Compared | None) -> str:
    return "" if case is None else _reached(case.reached, case)


def _limit_of(case: Compared) -> str:
    assert case.goal_is is not None
    return f"{number(case.goal)} {case.goal_is}"


def _reached(value: float | None, case: Compared) -> str:
    if value is None:
        return ""
    assert case.goal is not None
    if value <= case.goal:
        return number(value)
    text = number(value)
    if text == number(case.goal):  # three digits do not show that the goal is missed
        text = f"{value:.5g}"
    return f"**{text}**"


def _figure(value: float | None, case: Compared) -> str:
    return f"{number(value)} {case.unit}"
