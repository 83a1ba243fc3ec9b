"""Pictures of the architecture: the layers by the import contracts, and the way of one job by a traced dry run."""

from __future__ import annotations

import ast
import re
import sys
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from contextlib import redirect_stdout
from io import StringIO
from pathlib import Path
from types import FrameType
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import FancyBboxPatch

from maya_un.cli.main import main
from maya_un.plots.style import blank, figure_style

ROOT = Path(__file__).resolve().parent.parent
SOURCE = ROOT / "src"

CLAUSE_END = re.compile(r": |,? (?:as|from|on|over|of a|that|whether) ")
"""The ends of clauses, at which a phrase may be cut."""

BLUE, EDGE, TEXT = "#dbe9f6", "#5b7ea1", "#20303f"
GREY = "#5a6b7b"

WAY = (
    *(f"maya_un.{layer}" for layer in ("cli", "service", "process", "robot", "controller")),
    *(f"dmc41x3.{layer}" for layer in ("driver", "wire", "twin")),
    "maya_un.machine",
)
"""Layers of the way of one job, from the command to the mechanics. Each calls the next."""


def layers() -> Figure:
    """Draw the layers of the three packages; an upper layer may import the lower ones."""
    with figure_style():
        figure = blank(11.0, 9.4)
        _draw_layers(_empty(figure))
    return figure


def _draw_layers(axes: Axes) -> None:
    rows = _contract("layers")
    height = 1.0 / (len(rows) + 1)
    for index, row in enumerate(rows):
        _row(axes, "maya_un", row, 0.0, 1.0 - (index + 1.6) * height, 0.64, height)
    _title(axes, "maya_un", 0.32)
    for package, contract, top in (("maya_ros", "maya-ros-layers", 0), ("dmc41x3", "dmc41x3-layers", 7)):
        y = 1.0 - (top + 0.6) * height
        axes.text(0.84, y + 0.35 * height, package, ha="center", va="center", fontsize=13, weight="bold", color=TEXT)
        for index, row in enumerate(_contract(contract)):
            _row(axes, package, row, 0.68, y - (index + 1.0) * height, 0.32, height)
    note = "Each layer imports only layers below it.\nmaya_ros imports maya_un and dmc41x3,\nmaya_un imports dmc41x3."
    axes.text(0.84, 0.06, note, ha="center", va="center", fontsize=9, color=GREY)


def way() -> Figure:
    """Draw the layers that one job passes in a dry run, with the module of each that the layer above calls most."""
    calls = _calls()
    with figure_style():
        figure = blank(7.0, 8.6)
        _draw_way(_empty(figure), calls)
    return figure


def _draw_way(axes: Axes, calls: Mapping[str, Mapping[str, int]]) -> None:
    height = 1.0 / len(WAY)
    for index, layer in enumerate(WAY):
        y = 1.0 - (index + 0.85) * height
        modules = [name for name, _ in sorted(calls[layer].items(), key=lambda one: (-one[1], one[0]))[:4]]
        _box(axes, (0.02, y, 0.96, 0.7 * height), layer, ", ".join(modules))
        if index:
            axes.annotate(
                "", (0.1, y + 0.7 * height), (0.1, y + height), arrowprops={"arrowstyle": "-|>", "color": EDGE}
            )


def _contract(name: str) -> list[list[str]]:
    """Return the rows of a contract of layers in pyproject.toml, the highest first."""
    contracts = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["importlinter"]
    (rows,) = [one["layers"] for one in contracts["contracts"] if one["id"] == name]
    return [[part.strip() for part in re.split(r"[|:]", row)] for row in rows]


def _phrase(package: str, layer: str) -> str:
    """Return the first sentence of a layer's docstring."""
    place = SOURCE / package / layer
    file = place / "__init__.py" if place.is_dir() else place.with_suffix(".py")
    text = ast.get_docstring(ast.parse(file.read_text(encoding="utf-8"))) or ""
    return re.split(r"[.;](?:\s|$)", text.split("\n\n")[0].replace("\n", " "))[0].replace("`", "")


def _row(axes: Axes, package: str, names: Sequence[str], x: float, y: float, width: float, height: float) -> None:
    if len(names) > 3:
        _box(axes, (x + 0.003, y, width - 0.006, 0.8 * height), "", " · ".join(names))
        return
    each = width / len(names)
    for index, name in enumerate(names):
        most = int(each * 150)
        place = (x + index * each + 0.003, y, each - 0.006, 0.8 * height)
        _box(axes, place, name, _cut(name, _phrase(package, name), most))


def _cut(name: str, phrase: str, most: int) -> str:
    """Return the clauses of a phrase that fit into so many characters; one that repeats the name is left out."""
    first, _, rest = phrase.partition(": ")
    if rest and re.fullmatch(rf"(the |ros-)?{name}\w*", first, re.IGNORECASE):
        phrase = rest[0].upper() + rest[1:]
    ends = [*(found.start() for found in CLAUSE_END.finditer(phrase)), len(phrase)]
    return phrase[: max((end for end in ends if end <= most), default=0)]


def _box(axes: Axes, place: tuple[float, float, float, float], name: str, phrase: str) -> None:
    x, y, width, height = place
    axes.add_patch(
        FancyBboxPatch((x, y), width, height, boxstyle="round,pad=0,rounding_size=0.006", fc=BLUE, ec=EDGE, lw=0.8)
    )
    middle = x + width / 2
    if name:
        axes.text(middle, y + 0.68 * height, name, ha="center", va="center", fontsize=10, weight="bold", color=TEXT)
    axes.text(middle, y + (0.28 if name else 0.5) * height, phrase, ha="center", va="center", fontsize=7.5, color=GREY)


def _title(axes: Axes, text: str, x: float) -> None:
    axes.text(x, 0.985, text, ha="center", va="center", fontsize=13, weight="bold", color=TEXT)


def _empty(figure: Figure) -> Axes:
    figure.set_layout_engine("none")
    axes: Axes = figure.add_axes((0.01, 0.01, 0.98, 0.98))
    axes.set(xlim=(0.0, 1.0), ylim=(0.0, 1.0))
    axes.axis("off")
    return axes


def _calls() -> dict[str, dict[str, int]]:
    """Return how many functions of each module of a layer run in a dry run of the first example."""
    seen: set[Any] = set()

    def profile(frame: FrameType, event: str, _: object) -> None:
        if event == "call":
            seen.add(frame.f_code)

    sys.setprofile(profile)
    try:
        with redirect_stdout(StringIO()):
            main(["run", str(ROOT / "examples" / "01_pick_and_place.yaml"), "--dry-run"])
    finally:
        sys.setprofile(None)
    found: dict[str, dict[str, int]] = {layer: {} for layer in WAY}
    for layer, module in _modules(code.co_filename for code in seen):
        if layer in found:
            found[layer][module] = found[layer].get(module, 0) + 1
    return found


def _modules(files: Iterator[str]) -> Iterator[tuple[str, str]]:
    """Yield package with layer, and module, of source files of the project."""
    for file in files:
        path = Path(file)
        if path.is_relative_to(SOURCE):
            package, layer, *rest = path.relative_to(SOURCE).with_suffix("").parts
            if path.stem != "__init__":
                yield f"{package}.{layer}", rest[-1] if rest else layer
