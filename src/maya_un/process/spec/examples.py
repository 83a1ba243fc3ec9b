"""The example jobs, which are part of the package; `examples/` in the repository links to them."""

from __future__ import annotations

from collections.abc import Generator
from itertools import takewhile
from pathlib import Path

from dmc41x3.i18n import translations
from maya_un.process.spec.documents import read_document
from maya_un.schema.previews import ExampleJob

EXAMPLES = Path(__file__).parents[2] / "examples"
"""The folder of the example jobs."""


def title_and_description(path: Path) -> tuple[str, str]:
    """Return the name of a job in a YAML file, and the first paragraph of the file's first comment, in one line."""
    lines = path.read_text(encoding="utf-8").splitlines()
    comment = (line.removeprefix("#").strip() for line in takewhile(lambda line: line.startswith("#"), lines))
    return str(read_document(path)["name"]), " ".join(takewhile(bool, comment))


def example_jobs() -> Generator[None, None, list[ExampleJob]]:
    """Return the example jobs in the order of their names; for a worker, because it reads files."""
    found: list[ExampleJob] = []
    for path in sorted(EXAMPLES.glob("*.yaml")):
        title, about = map(translations, title_and_description(path))
        found.append(ExampleJob(path.stem, title, about, path.read_text(encoding="utf-8")))
        yield
    return found
