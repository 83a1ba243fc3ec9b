"""Reading job files."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from maya_un.process.documents import read_document
from maya_un.process.job import Job


def load_job(path: Path) -> Job:
    """Return the job of a file; one without a name is called as the file.

    Raises `FileUnreadable` for a file that cannot be read or parsed, `InvalidJob` for what it says.
    """
    return Job.parse(_named(read_document(path), path))


def _named(data: Any, path: Path) -> Any:
    if not isinstance(data, dict) or "name" in data:
        return data
    return {**data, "name": path.stem.encode(errors="replace").decode()[:64]}
