"""`maya config`: load, check and write the configuration; options for the twin only."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from dmc41x3.address import SIM
from dmc41x3.files import unwritable, write
from dmc41x3.i18n import phrase, translate
from maya_un.cli import output
from maya_un.cli.settings import OutputSettings
from maya_un.config import Config, default_path, for_people, load, template
from maya_un.config.files import parse, shown, written
from maya_un.errors import ConfigExists, InvalidCommandLine, InvalidConfig
from maya_un.validation import reason_of
from maya_un.values import Point

if TYPE_CHECKING:
    from maya_un.machine.truth import TrueConstants
    from maya_un.machine.wiring import Wiring
    from maya_un.process.spec.job import Job


def configuration(settings: OutputSettings) -> Config:
    """Return the current configuration: --config, else $MAYA_CONFIG, else the user's, else the manual's."""
    return load(None if settings.config is None else Path(settings.config))


def config_file(settings: OutputSettings) -> Path:
    """Return the path of the configuration file, which may not exist."""
    return default_path() if settings.config is None else Path(settings.config)


def taught_places(settings: OutputSettings) -> Path:
    """Return the path of the file of taught places: `poses.toml` beside the configuration file, which may not exist."""
    return config_file(settings).with_name("poses.toml")


def _place(file: str | None, settings: OutputSettings) -> Path:
    return Path(file) if file else config_file(settings)


def show(settings: OutputSettings) -> int:
    """Print every current key with its meaning, in the units of people or in SI; return the exit code."""
    config = configuration(settings)
    text = for_people(config, si=settings.units == "si").rstrip()
    return output.answer(config.model_dump(mode="json"), text, settings)


def check(file: str | None, settings: OutputSettings) -> int:
    """Check a configuration file; raises `FileUnreadable` and `InvalidConfig`."""
    place = _place(file, settings)
    if file is None and settings.config is None and not place.exists():
        return output.answer(
            {"path": str(place), "exists": False},
            translate("no file at {path}: the manual's values apply", settings.language, path=place),
            settings,
        )
    load(place)
    return output.answer(
        {"path": str(place), "exists": True},
        translate("{path} is a valid configuration.", settings.language, path=place),
        settings,
    )


def init(file: str | None, settings: OutputSettings) -> int:
    """Write a configuration with every key commented out; raises `ConfigExists` and `FileUnwritable`."""
    place = _place(file, settings)
    try:
        place.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise unwritable(place, error) from error
    if place.exists() or place.is_symlink():
        raise ConfigExists(path=place)
    write(place, template())
    return output.answer({"path": str(place)}, translate("Written: {path}", settings.language, path=place), settings)


def require_twin(address: str, command: str, **options: object) -> None:
    """Raise `InvalidCommandLine` if one of the `options` (None: not given) does not apply to a real machine."""
    given = [name for name, value in options.items() if value is not None]
    if given and address != SIM:
        reason = phrase("--{option} is for the twin, and {address} is a real machine", option=given[0], address=address)
        raise InvalidCommandLine(reason=reason, command=command)


DRAWN, MISWIRED = "drawn", "miswired"
"""The words for a twin whose small differences from the configuration, or one mistake in its wiring, are drawn."""


def truth_of_twin(truth: str | None, config: Config, seed: int) -> TrueConstants | None:
    """Return the constants of the twin's machine for --truth, None if it is as configured.

    `truth` is a file with the keys of the configuration that are different on the machine, and the mistakes in its
    wiring (table `miswired`), or one of the words `drawn` and `miswired`. Raises `FileUnreadable` and `InvalidConfig`.
    """
    if truth is None:
        return None
    from random import Random

    from maya_un.assembly.controller import machine_of
    from maya_un.machine import wiring_faults
    from maya_un.machine.truth import TrueConstants

    if truth == DRAWN:
        return TrueConstants.built(Random(seed), machine_of(config))
    if truth == MISWIRED:
        return wiring_faults.drawn(Random(seed), machine_of(config)).truth
    keys = dict(written(Path(truth)))
    mistakes = keys.pop(MISWIRED, None)
    if mistakes is None:
        return machine_of(load(Path(truth), config))
    return replace(machine_of(parse(keys, config)), wiring=_wiring(mistakes))


def _wiring(mistakes: object) -> Wiring:
    from pydantic import TypeAdapter, ValidationError

    from maya_un.machine.wiring import Wiring

    try:
        return TypeAdapter(Wiring).validate_python(mistakes)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        place = ".".join(map(str, (MISWIRED, *first["loc"])))
        raise InvalidConfig(key=place, value=shown(first["input"]), reason=reason_of(first)) from error


def on_the_table(table: str | None, config: Config, settings: OutputSettings) -> dict[str, Point]:
    """Return the start positions of the parts of a job file [m], none without a file.

    Raises as `load_job` and `starting_parts`.
    """
    if table is None:
        return {}
    from maya_un.process.spec.job import load_job

    return parts_of(load_job(Path(table)), config, settings)


def parts_of(job: Job, config: Config, settings: OutputSettings) -> dict[str, Point]:
    """Return the start positions of the parts of a job [m]; raises as `starting_parts`."""
    from maya_un.kinematics.mechanism import Mechanism
    from maya_un.process.spec.poses import PoseStore
    from maya_un.process.spec.tasks import starting_parts

    store = PoseStore(Mechanism.of(config), taught_places(settings))
    return starting_parts(job, config.cell.grasp_height, store.taught)
