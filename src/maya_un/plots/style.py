"""The style of all pictures, and their output: the same picture gives the same bytes."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from dmc41x3.files import write
from maya_un.errors import InvalidValue

if TYPE_CHECKING:
    from matplotlib.typing import RcKeyType

FORMATS = ("svg", "png", "pdf")
"""Formats of a picture; the file's ending selects one."""

BLUE = "#0072B2"
ORANGE = "#D55E00"
GREEN = "#009E73"
PURPLE = "#AA4499"
YELLOW = "#E69F00"
"""Colours that are distinguishable with colour blindness (Okabe and Ito; purple darkened for thin lines)."""

INK = "#262626"
GREY = "#767676"
PALE = "#C9C9C9"
REACHABLE = "#DCEAF6"
FORBIDDEN = "#F6DDD3"

LINE_B = BLUE
LINE_C = ORANGE
BOOM = GREEN
"""The axes have the same colours in every picture: a green, b blue, c orange."""

PAGE_WIDTH = 7.2
"""Width of a picture that stands alone on a page [inch]."""

DENSITY = 150
"""Dots per inch of a PNG."""

_RULES: dict[RcKeyType, Any] = {
    "axes.axisbelow": True,
    "axes.edgecolor": GREY,
    "axes.grid": False,
    "axes.labelcolor": INK,
    "axes.labelsize": 9,
    "axes.linewidth": 0.8,
    "axes.spines.right": False,
    "axes.spines.top": False,
    "axes.titlelocation": "left",
    "axes.titlesize": 10,
    "axes.titleweight": "bold",
    "figure.constrained_layout.use": True,
    "figure.facecolor": "white",
    "font.family": "DejaVu Sans",
    "font.size": 9,
    "grid.color": "#E4E4E4",
    "grid.linewidth": 0.6,
    "hatch.color": PALE,
    "hatch.linewidth": 0.6,
    "legend.fontsize": 8,
    "legend.frameon": False,
    "lines.linewidth": 1.4,
    "pdf.fonttype": 42,
    "savefig.dpi": DENSITY,
    "svg.fonttype": "none",
    "svg.hashsalt": "maya",
    "text.color": INK,
    "xtick.color": GREY,
    "xtick.labelcolor": INK,
    "xtick.labelsize": 8,
    "ytick.color": GREY,
    "ytick.labelcolor": INK,
    "ytick.labelsize": 8,
}

_NO_DATES: dict[str, dict[str, None]] = {
    "svg": {"Date": None, "Creator": None},
    "png": {"Software": None},
    "pdf": {"CreationDate": None, "Creator": None, "Producer": None},
}


@contextmanager
def figure_style() -> Iterator[None]:
    """Apply the style of Maya's pictures to everything drawn inside, independent of the user's matplotlibrc."""
    with mpl.rc_context():
        mpl.rcdefaults()
        mpl.rcParams.update(_RULES)
        yield


def blank(width: float = PAGE_WIDTH, height: float = 4.5) -> Figure:
    """Return an empty figure of `width` × `height` [inch], for use inside `figure_style`."""
    return Figure(figsize=(width, height))


def kind_of(path: Path) -> str:
    """Return the format of a file's ending; raises `InvalidValue` for an ending that is not in `FORMATS`."""
    kind = path.suffix.removeprefix(".").lower()
    if kind not in FORMATS:
        raise InvalidValue(key="--output", value=repr(str(path)), reason="it must end in .svg, .png or .pdf")
    return kind


def rendered(figure: Figure, kind: str) -> bytes:
    """Return a figure as a file of one of `FORMATS`: without a date, and with text as text in SVG."""
    target = BytesIO()
    with figure_style():
        figure.savefig(target, format=kind, metadata=_NO_DATES[kind])
    return target.getvalue()


def save(figure: Figure, path: Path) -> None:
    """Write a figure in the format of `path`'s ending. Raises `InvalidValue` and `FileUnwritable`."""
    data = rendered(figure, kind_of(path))
    write(path, data)


def quiet_grid(axes: Axes) -> None:
    """Draw a pale grid under the contents of `axes`."""
    axes.grid(visible=True)
