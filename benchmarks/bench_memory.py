"""Memory of `maya up` on the twin: when it is ready, and after it has homed and carried out a job."""

from __future__ import annotations

import json
import re
import subprocess
import sys
import tempfile
from pathlib import Path

from harness import Case, Goal, measure, report
from job import pairs
from service import MAYA, Service, service

SPEED = "200"


def resident(pid: int | str, field: str = "VmRSS") -> float:
    """Return the resident memory of a process now, or its peak (`VmHWM`) [bytes]; Linux only."""
    status = Path(f"/proc/{pid}/status").read_text(encoding="ascii")
    found = re.search(rf"^{field}:\s+(\d+) kB", status, re.MULTILINE)
    assert found, f"{field} is not in /proc/{pid}/status"
    return float(found[1]) * 1024.0


def bare() -> float:
    """Return the memory of a Python that has imported nothing [bytes]."""
    look = "print(next(line.split()[1] for line in open('/proc/self/status') if line.startswith('VmRSS')))"
    said = subprocess.run([sys.executable, "-c", look], capture_output=True, text=True, check=True)
    return float(said.stdout) * 1024.0


def carry_out_a_job(running: Service) -> None:
    """Have the running robot home and carry a part to and fro."""
    with tempfile.NamedTemporaryFile("w", suffix=".json") as file:
        json.dump(pairs(4), file)
        file.flush()
        subprocess.run([MAYA, "run", file.name], env=running.environment, capture_output=True, check=True)


def sample(job: bool) -> float:
    """Return the peak memory of a `maya up` of its own [bytes]."""
    with service("--speed", SPEED) as running:
        if job:
            carry_out_a_job(running)
        return resident(running.pid, "VmHWM")


def main() -> None:
    cases = [
        Case("bare Python", bare, "MB"),
        Case("maya up, ready (peak)", lambda: sample(job=False), "MB", Goal(70.0)),
        Case("maya up, after a job (peak)", lambda: sample(job=True), "MB", Goal(70.0)),
    ]
    report(measure(cases, rounds=2, by=max))


if __name__ == "__main__":
    main()
