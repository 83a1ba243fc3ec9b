"""Shared by every test: virtual time for coroutines, campaigns with a size and a seed, hypothesis profiles."""

from __future__ import annotations

import asyncio
import functools
import gc
import inspect
import os
import secrets
import signal
from collections.abc import Callable, Coroutine, Iterator
from typing import Any

import hypothesis
import pytest

from dmc41x3.loops import run_virtual
from tests import fork_server
from tests.campaign import Campaign, Ledger

pytest_plugins = ["tests.errors_seen", "tests.hard_timeout", "tests.secrecy"]
DEFAULT_SEED = 20190
LONG_TIMEOUT = 3600.0
"""Wall limit of one test [s] where campaigns have their full size; pyproject.toml has the ordinary one."""
LONG = os.environ.get("MAYA_TEST_LONG", "") not in {"", "0"}
LEDGER = pytest.StashKey[Ledger]()
SEED = pytest.StashKey[int]()
WAITING = pytest.StashKey[dict[str, str]]()

Test = Callable[..., Coroutine[Any, Any, None]]


def _seed() -> int:
    text = os.environ.get("MAYA_TEST_SEED", str(DEFAULT_SEED))
    try:
        return secrets.randbelow(2**31) if text == "random" else int(text)
    except ValueError:
        raise pytest.UsageError(f"the seed must be a whole number or 'random', not {text!r}") from None


def _load_profile() -> None:
    # The machine may be shared and slow: the only wall clock that fails a test is pytest-timeout's.
    common = hypothesis.settings(
        deadline=None, print_blob=True, suppress_health_check=[hypothesis.HealthCheck.too_slow]
    )
    hypothesis.settings.register_profile("ci", common, max_examples=50, database=None)
    hypothesis.settings.register_profile("long", common, max_examples=2_000)
    hypothesis.settings.load_profile("long" if LONG else "ci")


@pytest.hookimpl(tryfirst=True)
def pytest_configure(config: pytest.Config) -> None:
    """Choose the run's seed, before hypothesis looks for its own; take interrupts as in a terminal.

    A shell ignores them in what it starts in the background, and all that the tests start would inherit this.
    """
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    _load_profile()
    seed = _seed()
    config.stash[SEED] = seed
    config.stash[LEDGER] = Ledger()
    config.stash[WAITING] = {}
    if LONG and config.getoption("timeout", None) is None:
        config.option.timeout = LONG_TIMEOUT
    if config.getoption("hypothesis_seed", None) is None:
        config.option.hypothesis_seed = str(seed)


def _sizes_and_seed(config: pytest.Config) -> list[str]:
    sizes = "full (--long)" if LONG else "for CI (./test --long runs the full ones)"
    again = f"./test {'--long ' if LONG else ''}--seed {config.stash[SEED]}"
    return [
        f"campaigns: sizes {sizes}, seed {config.stash[SEED]} ({again} repeats this run)",
        f"hypothesis: {hypothesis.settings().max_examples} examples a property, "
        f"seed {config.getoption('hypothesis_seed')}",
    ]


def pytest_report_header(config: pytest.Config) -> list[str]:
    """Say sizes and seed before anything runs."""
    return _sizes_and_seed(config)


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter, config: pytest.Config) -> None:
    """Say sizes and seed again, with the campaigns that ran; with `-m waits --collect-only`, list the reasons first."""
    if config.option.collectonly and "waits" in config.option.markexpr:
        terminalreporter.section("real time that tests wait for")
        for test, reason in config.stash[WAITING].items():
            terminalreporter.line(f"{test}: {reason}")
    terminalreporter.section("campaigns")
    for name, size in config.stash[LEDGER].sizes.items():
        terminalreporter.line(f"{size:>7}  {name}")
    for line in _sizes_and_seed(config):
        terminalreporter.line(line)


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Iterator[object]:
    """Have the garbage collector never look at what collecting makes: thousands of tests, which stay to the end."""
    gc.disable()
    try:
        return (yield)
    finally:
        gc.freeze()
        gc.enable()


@pytest.fixture(scope="module", autouse=True)
def frozen_remains() -> Iterator[None]:
    """Hide the objects that a file of tests leaves from the garbage collector, which would walk them again and again.

    Without this, a full collection takes seconds in a worker that has run half of the tests.
    """
    yield
    gc.collect()
    gc.freeze()


@pytest.fixture(scope="module", autouse=True)
def forked_workers() -> Iterator[None]:
    """Fork the worker processes of robots within this process: to start one from nothing takes half a second."""
    with fork_server.forked_workers():
        yield


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Leave what is marked `long` to `./test --long`; have workers begin with what takes longest."""
    left_out = [] if LONG else [item for item in items if item.get_closest_marker("long")]
    if left_out:
        config.hook.pytest_deselected(items=left_out)
        items[:] = [item for item in items if item not in left_out]
    if hasattr(config, "workerinput"):
        from tests.scheduling import in_order

        items[:] = in_order(items)


def pytest_collection_finish(session: pytest.Session) -> None:
    """Note what the selected tests wait for; cases of one test wait for the same."""
    marks = {item.nodeid.partition("[")[0]: item.get_closest_marker("waits") for item in session.items}
    session.config.stash[WAITING] = {test: " ".join(mark.args) for test, mark in marks.items() if mark is not None}


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> Any:
    """Share the tests between workers, where there are some."""
    from tests.scheduling import scheduler

    return scheduler(config, log)


def pytest_sessionfinish(session: pytest.Session) -> None:
    """Send the counts of a worker to the process that sums up."""
    output: dict[str, Any] | None = getattr(session.config, "workeroutput", None)
    if output is not None:
        output["campaigns"] = session.config.stash[LEDGER].sizes


@pytest.hookimpl(optionalhook=True)
def pytest_testnodedown(node: Any) -> None:
    """Take what a worker has counted; one that died has counted nothing."""
    node.config.stash[LEDGER].sizes.update(getattr(node, "workeroutput", {}).get("campaigns", {}))


@pytest.fixture
def campaign(request: pytest.FixtureRequest) -> Campaign:
    """Return size and seed of this test's random campaign."""
    stash = request.config.stash
    return Campaign(request.node.nodeid, stash[SEED], LONG, stash[LEDGER])


@pytest.hookimpl(tryfirst=True)
def pytest_pyfunc_call(pyfuncitem: pytest.Function) -> None:
    """Have `async def` tests, those under `@given` included, run in a loop whose clock jumps."""
    property_ = getattr(pyfuncitem.obj, "hypothesis", None)
    if inspect.iscoroutinefunction(pyfuncitem.obj):
        pyfuncitem.obj = _in_virtual_time(pyfuncitem.obj)
    elif property_ is not None and inspect.iscoroutinefunction(property_.inner_test):
        property_.inner_test = _in_virtual_time(property_.inner_test)


def _in_virtual_time(test: Test) -> Callable[..., None]:
    @functools.wraps(test)
    def run(*args: Any, **kwargs: Any) -> None:
        run_virtual(_watched(test(*args, **kwargs)))

    return run


async def _watched(test: Coroutine[Any, Any, None]) -> None:
    """Run a test; fail it for tasks it leaves behind and for errors that nobody awaited."""
    unseen: list[str] = []
    asyncio.get_running_loop().set_exception_handler(lambda _, context: unseen.append(_describe(context)))
    before = asyncio.all_tasks()
    await test
    left = sorted(repr(task) for task in asyncio.all_tasks() - before)
    assert not left, f"tasks left behind: {left}"
    assert not unseen, f"errors nobody awaited: {unseen}"


def _describe(context: dict[str, Any]) -> str:
    return f"{context['message']}: {context.get('exception')!r}"
