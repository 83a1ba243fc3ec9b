"""Build hook of the wheel: with MAYA_COMPILE=1 it compiles the modules that pyproject.toml lists, with mypyc.

The wheel then has the compiled modules beside their sources, for one platform and one version of Python. Without the
variable, and in an editable install, nothing is compiled and no compiler is needed.
"""

from __future__ import annotations

import os
import shutil
import sys
import tempfile
from collections.abc import Iterator
from contextlib import chdir
from pathlib import Path
from typing import Any, cast

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

ASKED = "MAYA_COMPILE"
"""Variable of the environment that asks for compiled modules with `1`."""

FLAGS = ("-ffp-contract=off", "-g0")
"""Options of the C compiler: without the first one, some processors round a product and a sum once instead of twice."""


class CompilingHook(BuildHookInterface[Any]):
    """Adds compiled modules to the wheel."""

    _made: Path | None = None

    def dependencies(self) -> list[str]:
        """Return what compiling needs beside a C compiler."""
        return list(self.config["requires"]) if self._asked("standard") else []

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Compile, and add the files to the wheel. Ends the build if mypyc or the C compiler fails."""
        if not self._asked(version):
            return
        self._made = Path(tempfile.mkdtemp())
        libraries = compiled(Path(self.root) / "src", list(self._modules()), self._made)
        build_data["force_include"] |= {str(path): str(path.relative_to(self._made / "lib")) for path in libraries}
        build_data["pure_python"] = False
        build_data["infer_tag"] = True

    def finalize(self, version: str, build_data: dict[str, Any], artifact_path: str) -> None:
        """Remove the intermediate files."""
        if self._made is not None:
            shutil.rmtree(self._made)

    def _asked(self, version: str) -> bool:
        return version == "standard" and os.environ.get(ASKED) == "1"

    def _modules(self) -> Iterator[str]:
        """Yield the paths of the modules to compile, relative to the folder of the sources."""
        source = Path(self.root) / "src"
        patterns, interpreted = cast("list[str]", self.config["modules"]), self.config["interpreted"]
        for path in sorted(path for pattern in patterns for path in source.glob(pattern)):
            module = str(path.relative_to(source))
            if path.stem != "__init__" and module not in interpreted:
                yield module


def compiled(source: Path, modules: list[str], folder: Path) -> list[Path]:
    """Compile modules of the folder `source` and return the libraries, which are in `folder`/lib."""
    from mypyc.build import mypycify  # pyright: ignore[reportMissingImports]
    from setuptools import Distribution

    options = ["--ignore-missing-imports", "--follow-imports=silent", f"--python-executable={sys.executable}"]
    with chdir(source):
        extensions = mypycify([*options, *modules], opt_level="2", multi_file=True, target_dir=str(folder / "c"))
        for extension in extensions:
            extension.extra_compile_args += FLAGS
        command = Distribution({"ext_modules": extensions}).get_command_obj("build_ext")
        command.build_lib, command.build_temp = str(folder / "lib"), str(folder / "temp")
        command.parallel = os.cpu_count()
        command.ensure_finalized()
        command.run()
    return sorted((folder / "lib").rglob("*.so"))
