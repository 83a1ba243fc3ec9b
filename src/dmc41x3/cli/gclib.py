"""`dmc gclib`: a replacement of Galil's module gclib, installed in this environment or used for one run."""

from __future__ import annotations

import os
import subprocess
import sys
import sysconfig
from collections.abc import Sequence
from pathlib import Path

from dmc41x3 import files
from dmc41x3.cli import console
from dmc41x3.cli.console import OutputSettings
from dmc41x3.errors import FileNotOurs, FileUnreadable
from dmc41x3.gclib import shim
from dmc41x3.i18n import marked, translate

SHIM = Path(shim.__file__).parent
"""The directory that holds the module."""

_MODULE = "gclib.py"
_MARK = "The module `gclib` of maya-un"


def install(settings: OutputSettings, *, force: bool, site: Path | None = None) -> int:
    """Install the module in this environment (or `site`); raises `FileNotOurs` if the name is in use.

    `force` replaces another module, never a package.
    """
    place = _place(site)
    if _package(place).exists():
        raise FileNotOurs(
            path=str(_package(place)),
            remedy="another package named gclib is installed; remove it first, with the tool that installed it",
        )
    if place.exists() and not _ours(place) and not force:
        raise FileNotOurs(path=str(place), remedy="another package installed it; --force replaces it")
    files.write(place, _text())
    text = translate("`import gclib` finds {path} now.", settings.language, path=place)
    return console.answer({"path": str(place)}, text, settings)


def uninstall(settings: OutputSettings, *, site: Path | None = None) -> int:
    """Remove the module from this environment; raises `FileNotOurs` if another package installed it."""
    place = _place(site)
    if not place.exists():
        return console.answer({"path": None}, translate("There is no gclib here.", settings.language), settings)
    if not _ours(place):
        raise FileNotOurs(path=str(place), remedy="another package installed it, so nothing was removed")
    try:
        place.unlink()
    except OSError as error:
        raise files.unwritable(str(place), error) from error
    text = translate("{path} was removed.", settings.language, path=place)
    return console.answer({"path": str(place)}, text, settings)


def status(settings: OutputSettings, *, site: Path | None = None) -> int:
    """Print what `import gclib` finds in this environment; return the exit code."""
    place = _place(site)
    found = next((path for path in (_package(place), place) if path.exists()), None)
    ours = found == place and _ours(place)
    current = ours and place.read_text(encoding="utf-8", errors="replace") == _text()
    says = {"path": None if found is None else str(found), "ours": ours, "current": current}
    if found is None:
        text = marked("There is no gclib here. `{command} gclib install` installs it.")
    elif not ours:
        text = marked("Another package installed {path}.")
    elif current:
        text = marked("This package installed {path}.")
    else:
        text = marked("Another version of this package installed {path}. Run `{command} gclib install` again.")
    return console.answer(says, translate(text, settings.language, path=found, command=settings.site.command), settings)


def run(script: str, arguments: Sequence[str]) -> int:
    """Run an unchanged script in a process that finds this package's gclib first; return its exit code.

    If a signal ended the script, the exit code is 128 plus the signal number, as in a shell.
    """
    if not Path(script).is_file():
        raise FileUnreadable(path=script, reason="there is no such file")
    paths = [str(SHIM), os.environ.get("PYTHONPATH", "")]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, paths))}
    code = subprocess.run([sys.executable, script, *arguments], env=environment, check=False).returncode
    return code if code >= 0 else 128 - code


def _place(site: Path | None) -> Path:
    return (site or Path(sysconfig.get_paths()["purelib"])) / _MODULE


def _package(place: Path) -> Path:
    """Return the file of a package that Python would find before the module."""
    return place.with_suffix("") / "__init__.py"


def _ours(place: Path) -> bool:
    try:
        return _MARK in place.read_text(encoding="utf-8", errors="replace").partition("\n")[0]
    except OSError:
        return False


def _text() -> str:
    return (SHIM / _MODULE).read_text(encoding="utf-8")
