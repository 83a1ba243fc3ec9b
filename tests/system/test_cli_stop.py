"""`maya stop` against a service that hangs: the axes begin to brake all the same, and soon."""

from __future__ import annotations

import signal
from pathlib import Path

import pytest

from tests.system.processes import Wire, done, running

pytestmark = pytest.mark.system


def wait_for_motion(wire: Wire, *, moving: bool, within: float) -> None:
    """Ask until an axis moves, or none does; fails after `within` seconds of the controller's clock."""
    latest = wire.time + within
    while any(wire.numbers("_BGA,_BGB,_BGC")) is not moving:
        assert wire.time < latest, f"still not {'moving' if moving else 'at rest'}"


def wait_for_a_long_motion(wire: Wire, seconds: float, within: float) -> None:
    """Ask until the path under way lasts for `seconds` more; fails after `within` seconds of the controller's clock."""
    latest = wire.time + within
    while True:
        runs, length, gone, speed = wire.numbers("_BGS,_LES,_AVS,_VSS")
        if runs and length - gone > seconds * speed:
            return
        assert wire.time < latest, f"still no path of {seconds:g} s: {length - gone:g} counts are left at {speed:g}"


def test_stop_past_a_service_that_hangs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Without the guard, which would stop the axes of a hanging service by itself.

    The homing is slow: its first step
    takes less than a second, its second 21 s, which still lasts when a busy machine has started the command.
    """
    config = tmp_path / "unguarded.toml"
    config.write_text("[safety]\nguard_time = 0.0\n[homing]\nspeed = 0.002\n")
    monkeypatch.setenv("MAYA_CONFIG", str(config))
    with running("dmc serve --port 0 --seed 5") as twin:
        address = twin.until(":")
        with running(f"up --port 0 --address {address}") as up, Wire(address) as wire:
            up.until("maya home")
            with running("home") as home:
                home.until("running")
                wait_for_a_long_motion(wire, 15.0, within=30.0)
                up.send(signal.SIGSTOP)
                told = wire.time
                code, text = done("stop", cold=True)
                assert wire.time - told <= 10.0  # `scripts/bench start` measures it on a quiet machine
                assert (code, "began to brake" in text) == (0, True), text
                wait_for_motion(wire, moving=False, within=5.0)
                assert 4.0 in wire.numbers("_SCA,_SCB,_SCC")
                home.kill()


def test_an_up_that_was_killed_leaves_the_way_to_stop() -> None:
    with running("dmc serve --port 0 --seed 5") as twin:
        address = twin.until(":")
        with running(f"up --port 0 --address {address}") as up, Wire(address) as wire:
            up.until("maya home")
            with running("home") as home:
                home.until("running")
                wait_for_motion(wire, moving=True, within=20.0)
                up.kill()
                assert done("stop", cold=True)[0] == 0
                wait_for_motion(wire, moving=False, within=5.0)
                assert home.end()[0] == 1
    code, text = done("status")
    assert (code, "error 1020" in text) == (1, True)


def test_a_twin_on_tcp_speaks_galil() -> None:
    with running("dmc serve --port 0") as twin:
        address = twin.until(":")
        twin.until("maya dmc fault")
        code, text = done(f"dmc send {address} TP QR ^R^V --json".replace("^R^V", "\x12\x16"))
        assert code == 0, text
        assert "DMC41" in text
        code, text = done(f"dmc send {address} XY")
        assert (code, text.startswith("maya: error 1004: ")) == (1, True)
        taken = done(f"dmc serve --port {address.rpartition(':')[2]}")
        assert (taken[0], "error 5003" in taken[1]) == (2, True)
        twin.send(signal.SIGTERM)
        assert twin.end() == (0, "")


def test_there_is_one_robot_at_a_time() -> None:
    with running("up --port 0 --speed 10") as up:
        up.until("maya home")
        code, text = done("up --port 0")
        assert (code, "error 5004" in text) == (2, True)
        up.send(signal.SIGINT)
        assert up.end()[0] == 0
