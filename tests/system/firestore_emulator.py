"""Google's emulator of Firestore, which obeys security rules: java on loopback, with a project of its own.

It is the package google-cloud-cli-firestore-emulator of Google's repository for Debian, or a download of
`firebase setup:emulators:firestore`; FIRESTORE_EMULATOR_JAR names a copy elsewhere.
"""

from __future__ import annotations

import atexit
import os
import shutil
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import httpx
import pytest

from tests.ports import free_port
from tests.waiting import eventually

RULES = Path(__file__).parents[2] / "contrib/firebase/firestore.rules"
"""The security rules that the documentation recommends."""

_MAIN = "com.google.cloud.datastore.emulator.firestore.CloudFirestore"
_PACKAGE = Path("/usr/lib/google-cloud-sdk/platform/cloud-firestore-emulator/cloud-firestore-emulator.jar")

HTTP = httpx.Client(timeout=60.0)
"""For all requests of tests: each client of its own would read the machine's certificates."""
atexit.register(HTTP.close)


def jar() -> Path | None:
    """Return the file of the emulator, None if there is none."""
    named = os.environ.get("FIRESTORE_EMULATOR_JAR")
    downloads = (Path.home() / ".cache/firebase/emulators").glob("cloud-firestore-emulator-*.jar")
    places = [Path(named)] if named else [_PACKAGE, *sorted(downloads, reverse=True)]
    return next((place for place in places if place.exists()), None)


needs_emulator = pytest.mark.skipif(
    jar() is None or shutil.which("java") is None, reason="Google's Firestore emulator or java is not installed"
)


@contextmanager
def emulator(rules: Path) -> Iterator[int]:
    """Run the emulator with a file of rules while the block runs, and yield its port."""
    port = free_port()
    words = ["start", "--host=127.0.0.1", f"--port={port}", f"--rules={rules}"]
    process = subprocess.Popen(
        ["java", "-Duser.language=en", "-cp", str(jar()), _MAIN, *words],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    try:
        eventually(lambda: _answers(port) or process.poll() is not None, "the emulator")
        assert process.poll() is None, "the emulator does not start"
        yield port
    finally:
        process.kill()
        process.wait()


def _answers(port: int) -> bool:
    try:
        return HTTP.get(f"http://127.0.0.1:{port}/").is_success
    except httpx.HTTPError:
        return False
