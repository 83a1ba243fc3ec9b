"""Copies the definitions of messages, services and actions into the ROS packages, which must hold them to build.

The source is src/maya_ros/graph/definitions. With --check it writes nothing and says which copies are not current.
"""

from __future__ import annotations

import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
SOURCE = ROOT / "src" / "maya_ros" / "graph" / "definitions"
PACKAGES = ROOT / "ros"
FORMS = ("msg", "srv", "action")


def main(arguments: list[str]) -> int:
    """Write or check all copies; return 1 where a check found one that is not current."""
    wanted = {path.relative_to(SOURCE): path.read_text(encoding="utf-8") for path in _files(SOURCE)}
    there = {path.relative_to(PACKAGES): path.read_text(encoding="utf-8") for path in _files(PACKAGES)}
    stale = sorted(name for name in wanted.keys() | there.keys() if wanted.get(name) != there.get(name))
    if "--check" in arguments:
        for name in stale:
            print(f"ros/{name} is not current: run scripts/docs")
        return 1 if stale else 0
    for name in stale:
        _make(PACKAGES / name, wanted.get(name))
        print(f"ros/{name}")
    return 0


def _files(folder: Path) -> list[Path]:
    return [path for form in FORMS for path in folder.glob(f"*/{form}/*.{form}")]


def _make(copy: Path, text: str | None) -> None:
    if text is None:
        copy.unlink()
        return
    copy.parent.mkdir(parents=True, exist_ok=True)
    copy.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
