from __future__ import annotations

import signal

import pytest

from dmc41x3.cli.signals import as_ctrl_c


@pytest.mark.parametrize("kind", [signal.SIGTERM, signal.SIGHUP])
def test_termination_signal_interrupts_a_command(kind: signal.Signals) -> None:
    before = signal.signal(kind, signal.SIG_DFL)
    try:
        with pytest.raises(KeyboardInterrupt), as_ctrl_c():
            signal.raise_signal(kind)
        assert signal.getsignal(kind) is signal.SIG_DFL
    finally:
        signal.signal(kind, before)


def test_command_that_ignores_hangups_outlives_its_terminal() -> None:
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        with as_ctrl_c():
            signal.raise_signal(signal.SIGHUP)
        assert signal.getsignal(signal.SIGHUP) is signal.SIG_IGN
    finally:
        signal.signal(signal.SIGHUP, before)
