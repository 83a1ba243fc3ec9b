"""The frame of the scripts that generate files: write those that are not current, or with --check only name them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent


def update(files: Mapping[Path, str | None], arguments: Sequence[str], remedy: str) -> int:
    """Give each file its text, or delete it if the text is None, and print the names of the changed files.

    With --check among the `arguments`, change nothing: print the files that are not current, with the command that
    writes them (`remedy`), and return 1 if there are any.
    """
    check = "--check" in arguments
    stale = sorted(path for path, text in files.items() if _current(path) != text)
    for path in stale:
        if check:
            print(f"{path.relative_to(ROOT)} is not current: run {remedy}")
        else:
            _write(path, files[path])
            print(path.relative_to(ROOT))
    return 1 if check and stale else 0


def _current(path: Path) -> str | None:
    return path.read_text(encoding="utf-8") if path.exists() else None


def _write(path: Path, text: str | None) -> None:
    if text is None:
        path.unlink()
        return
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, encoding="utf-8")
