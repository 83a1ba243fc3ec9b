"""Makes the picture of `maya dmc terminal` in docs/images: the terminal itself, typed at, while a twin moves."""

from __future__ import annotations

import io
import re
import subprocess
import sys
import tempfile
from pathlib import Path

from rich.console import Console
from rich.terminal_theme import TerminalTheme
from rich.text import Text
from tmux import Pane, pane

PICTURE = Path(__file__).resolve().parent.parent / "docs" / "images" / "terminal.svg"
WIDTH, HEIGHT = 100, 30
MAYA = str(Path(sys.executable).with_name("maya"))
PROGRAM = '#HELLO\nMG "at",_TPC\nEN\n'
LIGHT = TerminalTheme(
    (255, 255, 255),
    (30, 30, 30),
    [(0, 0, 0), (190, 20, 20), (0, 120, 40), (150, 100, 0), (0, 60, 170), (140, 30, 140), (0, 110, 120), (90, 90, 90)],
    [
        (115, 115, 115),
        (190, 20, 20),
        (0, 120, 40),
        (150, 100, 0),
        (0, 60, 170),
        (140, 30, 140),
        (0, 110, 120),
        (0, 0, 0),
    ],
)
FORMAT = """\
<svg class="rich-terminal" viewBox="0 0 {width} {height}" xmlns="http://www.w3.org/2000/svg">
<style>
.{unique_id}-matrix {{ font-family: "DejaVu Sans Mono", Menlo, Consolas, monospace; font-size: {char_height}px;
  line-height: {line_height}px; }}
.{unique_id}-title {{ font-family: sans-serif; font-size: 18px; font-weight: bold; }}
{styles}
</style>
<defs>
<clipPath id="{unique_id}-clip-terminal">
<rect x="0" y="0" width="{terminal_width}" height="{terminal_height}"/>
</clipPath>
{lines}
</defs>
{chrome}
<g transform="translate({terminal_x}, {terminal_y})" clip-path="url(#{unique_id}-clip-terminal)">
{backgrounds}
<g class="{unique_id}-matrix">
{matrix}
</g>
</g>
</svg>
"""
"""The usual frame without a font from the network: pages must show the same without one."""


def main() -> None:
    """Type a short session and draw what shows."""
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "hello.dmc").write_text(PROGRAM, encoding="ascii")
        twin = subprocess.Popen([MAYA, "dmc", "serve", "--port", "0"], stdout=subprocess.PIPE, text=True)
        assert twin.stdout is not None
        address = next(line.split()[0] for line in twin.stdout if "127.0.0.1:" in line)
        command = ["env", f"--chdir={folder}", MAYA, "dmc", "terminal", address]
        try:
            with pane(command, width=WIDTH, height=HEIGHT, environment={"XDG_STATE_HOME": folder}) as shown:
                _session(shown)
                _draw(shown.picture(colours=True))
        finally:
            twin.terminate()
            twin.wait()


def _session(shown: Pane) -> None:
    shown.until("Ctrl-D end")
    shown.enter("help BG")
    shown.until("BG  ")
    shown.enter("SHBC;MG _TPB")
    shown.until(" 0.0000")
    shown.enter("BGA")
    shown.until("? 20")
    shown.enter(":download hello.dmc")
    shown.until("Downloaded")
    shown.enter(":watch _TPC/_SPC")
    shown.enter("SPC=2000;PRC=-100000;BGC")
    shown.until_true(lambda picture: re.search(r"^C +-\d\d\d", picture, re.MULTILINE) is not None, "C on its way")
    shown.enter("XQ #HELLO")
    shown.until("« at")
    shown.type("MG _TP")
    shown.until("axis C")


def _draw(picture: str) -> None:
    console = Console(record=True, width=WIDTH, height=HEIGHT, file=io.StringIO())
    console.print(Text.from_ansi(picture.rstrip("\n")))
    svg = console.export_svg(title="maya dmc terminal", theme=LIGHT, code_format=FORMAT, unique_id="terminal")
    PICTURE.write_text("\n".join(line.rstrip() for line in svg.splitlines()) + "\n", encoding="utf-8")
    print(PICTURE.relative_to(PICTURE.parents[2]))


if __name__ == "__main__":
    main()
