from __future__ import annotations

from itertools import pairwise, product

import pytest
from hypothesis import given
from hypothesis import strategies as st

from maya_un.process.journal import history
from maya_un.process.journal.protocol import Filter, JobOptions, JobRow, RequestOwner
from maya_un.process.journal.sqlite import MemoryJournal
from maya_un.schema.jobs import TaskState
from tests.journals import job_row

STATES = (TaskState.QUEUED, TaskState.HELD, TaskState.DONE, TaskState.FAILED)
NAMES = ("Two trays", "cubes 100%", "ÁRBOL", "a_b", "back\\slash")
OWNERS = ("ann", "bob")

JOBS = tuple(
    job_row(number, state=state, name=name, owner=RequestOwner(owner, "cli"), options=JobOptions(notes=f"for {state}"))
    for number, (state, name, owner) in enumerate(product(STATES, NAMES, OWNERS), 1)
)
"""Every state, name and owner once."""


async def filled() -> MemoryJournal:
    journal = MemoryJournal()
    await journal.add(*JOBS)
    return journal


def wanted(which: Filter) -> list[int]:
    """Return the numbers of the page, worked out by looking at every job."""

    def fits(job: JobRow) -> bool:
        found_by = f"{job.name} {job.options.notes}".casefold()
        return (
            (not which.states or job.state in which.states)
            and (which.owner is None or job.owner.name == which.owner)
            and all(word in found_by for word in which.text.casefold().split())
            and (which.below is None or job.id < which.below)
            and (which.above is None or job.id > which.above)
        )

    numbers = [job.id for job in JOBS if fits(job)]
    return (numbers if which.oldest_first else numbers[::-1])[: which.limit]


filters = st.builds(
    Filter,
    states=st.lists(st.sampled_from(STATES), unique=True, max_size=3).map(tuple),
    owner=st.none() | st.sampled_from((*OWNERS, "nobody")),
    text=st.sampled_from(("", "  ", "tray", "TWO for", "100%", "%", "_", "árbol", "\\", "held", "' OR 1=1 --")),
    below=st.none() | st.integers(0, 45),
    above=st.none() | st.integers(-1, 45),
    oldest_first=st.booleans(),
    limit=st.integers(0, 50),
)


@given(filters)
async def test_a_page_holds_the_jobs_that_fit_in_order(which: Filter) -> None:
    journal = await filled()
    page = await journal.page(which)
    assert [job.id for job in page] == wanted(which)
    assert all(job.body == {} for job in page)
    await journal.close()


async def test_pages_lead_on_without_a_gap() -> None:
    journal = await filled()
    seen: list[int] = []
    below: int | None = None
    while page := await journal.page(Filter(below=below, limit=7)):
        seen += [job.id for job in page]
        below = page[-1].id
    assert seen == [job.id for job in reversed(JOBS)]


async def test_listing_has_all_but_the_body() -> None:
    journal = await filled()
    (line,) = await journal.page(Filter(limit=1))
    assert line == job_row(
        len(JOBS), state=JOBS[-1].state, name=JOBS[-1].name, owner=JOBS[-1].owner, options=JOBS[-1].options, body={}
    )


async def test_a_page_has_a_longest() -> None:
    journal = MemoryJournal()
    await journal.add(*(job_row(number) for number in range(1, history.LONGEST_PAGE + 10)))
    assert len(await journal.page(Filter(limit=1_000_000))) == history.LONGEST_PAGE
    assert await journal.page(Filter(limit=-5)) == []


@pytest.mark.parametrize(
    "which",
    [Filter(), Filter(states=STATES), Filter(owner="ann"), Filter(owner="bob", states=STATES[:1]), Filter(above=3)],
    ids=str,
)
async def test_no_page_reads_the_whole_table_or_sorts_it(which: Filter) -> None:
    journal = await filled()
    statement, values = history._by_index(which)
    plan = await journal.read(
        lambda connection: connection.execute(f"EXPLAIN QUERY PLAN {statement}", values).fetchall()
    )
    steps = [step[-1] for step in plan]
    assert not [step for step in steps if step.startswith(("SCAN jobs", "SCAN labels"))]
    for step, sort in pairwise(steps):
        if "TEMP B-TREE" in sort:
            assert step.startswith("SCAN (subquery"), "only the few numbers that a state gave are sorted"
    await journal.close()
