"""The table of docs/how-to/move-from-the-original.md: a row for each rule of `maya migrate`, with its sentences."""

from __future__ import annotations

from pathlib import Path

from maya_ros.migration.original import RULES, Rule, Severity

PAGE = Path(__file__).resolve().parent.parent / "docs" / "how-to" / "move-from-the-original.md"
HEAD = "| the original | why it changes | here |\n|---|---|---|\n"
MARKS = {Severity.CHANGE: "", Severity.CHECK: " (check)", Severity.SAME: " (unchanged)"}


def page() -> str:
    """Return the page with its present table; the rest of it is written by hand."""
    before, head, rest = PAGE.read_text(encoding="utf-8").partition(HEAD)
    old = [line for line in rest.splitlines(keepends=True) if line.startswith("|")]
    return before + head + "".join(map(row, RULES)) + rest.removeprefix("".join(old))


def row(rule: Rule) -> str:
    """Return the row of a rule."""
    why, instead = (text.format(**rule.example) if rule.example else text for text in (rule.why, rule.instead))
    cells = (f"{rule.old}{MARKS[rule.kind]}", why, instead)
    return f"| {' | '.join(cell.replace('|', chr(92) + '|') for cell in cells)} |\n"
