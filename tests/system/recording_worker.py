"""A process that saves one recording after the other into a folder, until somebody kills it."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

from dmc41x3.wire.transcript import WirePiece
from maya_un.recorder.recording import Recording
from maya_un.recorder.store import RecordingStore
from tests.unit.recorder.recordings import RECORDING, UTC, state


def large() -> Recording:
    """Return a recording whose writing takes a while."""
    states = tuple(state(90.0 + number / 1000.0) for number in range(3_000))
    wire = tuple(WirePiece(90.0 + number / 1000.0, 1, "client", b"TP\r") for number in range(3_000))
    return replace(RECORDING, states=states, wire=wire)


def main(folder: Path) -> None:
    """Save for ever; say each name once it is kept."""
    store = RecordingStore(folder, 5, 1_000_000_000, lambda: UTC)
    recording = large()
    print("begun", flush=True)
    while True:
        print(store.save(recording).name, flush=True)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
