"""`maya dmc gclib`: putting the module somewhere, taking it away, telling what is there."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Callable, Sequence
from pathlib import Path

import pytest

from dmc41x3.cli import gclib
from dmc41x3.cli.console import ALONE, OutputSettings
from dmc41x3.errors import FileNotOurs, FileUnwritable
from maya_un.cli.dmc_tools.site import MAYA

Run = Callable[[Sequence[str]], int]

SETTINGS = OutputSettings()
FOREIGN = '"""Python wrapper for Galil gclib."""\n'


def status_of(capsys: pytest.CaptureFixture[str], site: Path) -> dict[str, object]:
    capsys.readouterr()
    assert gclib.status(OutputSettings(json=True), site=site) == 0
    return json.loads(capsys.readouterr().out)


def test_it_is_installed_found_and_taken_out_again(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    place = tmp_path / "gclib.py"
    assert status_of(capsys, tmp_path) == {"path": None, "ours": False, "current": False}
    assert gclib.install(SETTINGS, force=False, site=tmp_path) == 0
    assert status_of(capsys, tmp_path) == {"path": str(place), "ours": True, "current": True}
    code = "import gclib; print(gclib.py.__module__, issubclass(gclib.GclibError, Exception))"
    paths = os.pathsep.join([str(tmp_path), str(Path(__file__).parents[3] / "src")])
    done = subprocess.run(
        [sys.executable, "-c", code],
        env={"PYTHONPATH": paths},
        capture_output=True,
        text=True,
        check=True,
    )
    assert done.stdout.split() == ["dmc41x3.gclib.api", "True"]
    assert gclib.uninstall(SETTINGS, site=tmp_path) == 0
    assert not place.exists()
    assert gclib.uninstall(SETTINGS, site=tmp_path) == 0


def test_an_older_one_of_ours_is_replaced(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    gclib.install(SETTINGS, force=False, site=tmp_path)
    place = tmp_path / "gclib.py"
    place.write_text(place.read_text(encoding="utf-8") + "\n# older\n", encoding="utf-8")
    assert status_of(capsys, tmp_path)["current"] is False
    gclib.install(SETTINGS, force=False, site=tmp_path)
    assert status_of(capsys, tmp_path)["current"] is True


def test_foreign_file_is_replaced_by_force_only(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    place = tmp_path / "gclib.py"
    place.write_text(FOREIGN, encoding="utf-8")
    with pytest.raises(FileNotOurs, match="--force"):
        gclib.install(SETTINGS, force=False, site=tmp_path)
    with pytest.raises(FileNotOurs):
        gclib.uninstall(SETTINGS, site=tmp_path)
    assert place.read_text(encoding="utf-8") == FOREIGN
    assert status_of(capsys, tmp_path) == {"path": str(place), "ours": False, "current": False}
    gclib.install(SETTINGS, force=True, site=tmp_path)
    assert status_of(capsys, tmp_path)["ours"] is True


def test_a_package_of_that_name_is_never_touched(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "gclib").mkdir()
    package = tmp_path / "gclib" / "__init__.py"
    package.write_text(FOREIGN, encoding="utf-8")
    with pytest.raises(FileNotOurs, match="remove it first"):
        gclib.install(SETTINGS, force=True, site=tmp_path)
    assert status_of(capsys, tmp_path)["path"] == str(package)
    assert not (tmp_path / "gclib.py").exists()


def test_unwritable_place_is_reported(tmp_path: Path) -> None:
    with pytest.raises(FileUnwritable):
        gclib.install(SETTINGS, force=False, site=tmp_path / "none")


def test_damaged_copy_is_reported_as_outdated(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    gclib.install(OutputSettings(), force=False, site=tmp_path)
    module = tmp_path / "gclib.py"
    module.write_bytes(module.read_bytes() + b"\xff\xfe")
    assert gclib.status(OutputSettings(json=True), site=tmp_path) == 0
    assert '"current": false' in capsys.readouterr().out


def test_status_gives_advice(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    for site, command in ((ALONE, "`dmc gclib install`"), (MAYA, "`maya dmc gclib install`")):
        gclib.status(OutputSettings(site=site), site=tmp_path)
        assert command in capsys.readouterr().out


def test_answers_are_translated(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    settings, place = OutputSettings(language="es"), tmp_path / "gclib.py"
    gclib.status(settings, site=tmp_path)
    gclib.install(settings, force=False, site=tmp_path)
    gclib.status(settings, site=tmp_path)
    place.write_text(place.read_text(encoding="utf-8") + "# older\n", encoding="utf-8")
    gclib.status(settings, site=tmp_path)
    gclib.uninstall(settings, site=tmp_path)
    gclib.uninstall(settings, site=tmp_path)
    place.write_text(FOREIGN, encoding="utf-8")
    gclib.status(settings, site=tmp_path)
    assert capsys.readouterr().out.splitlines() == [
        "Aquí no hay ningún gclib. `dmc gclib install` lo instala.",
        f"Ahora `import gclib` encuentra {place}.",
        f"Este paquete instaló {place}.",
        f"Otra versión de este paquete instaló {place}. Ejecute otra vez `dmc gclib install`.",
        f"Se ha quitado {place}.",
        "Aquí no hay ningún gclib.",
        f"Otro paquete instaló {place}.",
    ]


@pytest.mark.parametrize("word", ["install", "uninstall", "status", "run"])
def test_every_word_has_its_help(run: Run, word: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["gclib", word, "--help"]) == 0
    assert f"dmc gclib {word}" in capsys.readouterr().out


def test_a_script_that_is_not_there_is_refused(run: Run, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["gclib", "run", "nowhere.py"]) == 2
    assert "error 4007" in capsys.readouterr().err


def test_words_behind_a_script_are_the_scripts(run: Run, tmp_path: Path) -> None:
    script = tmp_path / "s.py"
    said = tmp_path / "said"
    script.write_text(f"import sys\nopen({str(said)!r}, 'w').write(' '.join(sys.argv[1:]))\nsys.exit(3)\n")
    assert run(["gclib", "run", "--", str(script), "--json", "-x", "--force"]) == 3
    assert said.read_text(encoding="utf-8") == "--json -x --force"


def test_a_script_that_a_signal_ended_has_a_shells_exit_code(run: Run, tmp_path: Path) -> None:
    script = tmp_path / "ends.py"
    script.write_text("import os, signal\nos.kill(os.getpid(), signal.SIGTERM)\n")
    assert run(["gclib", "run", str(script)]) == 128 + 15
