"""The computer that a benchmark runs on."""

from __future__ import annotations

import os
import platform
from pathlib import Path

from maya_un.kinematics import closed
from scripts.performance_results import Computer


def computer() -> Computer:
    """Return what this machine is, and its load now."""
    system = platform.freedesktop_os_release().get("PRETTY_NAME", platform.system())
    one, five, fifteen = (round(load, 2) for load in os.getloadavg())
    compiled = Path(closed.__file__).suffix != ".py"
    return Computer(processor(), os.cpu_count() or 1, system, platform.python_version(), (one, five, fifteen), compiled)


def processor() -> str:
    """Return the processor's name."""
    lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    return next((line.partition(":")[2].strip() for line in lines if line.startswith("model name")), platform.machine())
