"""Taught places: `maya teach`, `maya poses`, `maya teach-pallet`, `maya pallets`.

Requests go to the running robot, which knows its position and uses its taught places for jobs. Without a running
robot, everything except teaching a pose is done in the file of taught places beside the configuration.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple, NoReturn

from dmc41x3.i18n import marked, translate, translate_phrase
from maya_un.cli import output
from maya_un.cli.client import ServiceClient
from maya_un.cli.configure import configuration, taught_places
from maya_un.cli.report import table
from maya_un.cli.settings import OutputSettings
from maya_un.cli.units import MILLIMETRES, OutputUnits, units_of
from maya_un.client import requests
from maya_un.errors import InvalidCommandLine, NameTaken, ServiceNotRunning
from maya_un.http.dates import now
from maya_un.kinematics.mechanism import Mechanism
from maya_un.process.spec.pallet import check_counts
from maya_un.process.spec.poses import PoseStore, checked_name
from maya_un.schema.encoding import to_data
from maya_un.service.places import TeachingService


class PalletRequest(NamedTuple):
    """A requested pallet; without corners, a person is prompted for each of them."""

    name: str
    rows: int
    columns: int
    corners: Sequence[str] = ()


def teach(name: str, settings: OutputSettings, *, replacing: bool) -> int:
    """Store the running robot's position under `name`; raises `ServiceNotRunning` and the errors of the service."""
    pose = _taught(ServiceClient.find(), name, replacing)
    return output.answer(pose, _said(pose, settings.language, units_of(settings)), settings)


def keep(client: ServiceClient, name: str, language: str, replacing: bool) -> str:
    """Store the position of the robot behind `client` under `name`, and return a message; raises as `teach`."""
    return _said(_taught(client, name, replacing), language, MILLIMETRES)


def poses(settings: OutputSettings) -> int:
    """List all taught poses."""
    found = _asked(settings, lambda client: client.ask(requests.poses()), TeachingService.poses)
    return output.answer({"poses": found}, _listed(found, settings.language, units_of(settings)), settings)


def remove(what: str, name: str, settings: OutputSettings) -> int:
    """Delete a pose or a pallet; raises `NotTaught`, and `InvalidValue` for the corner of a pallet."""
    forget = TeachingService.forget_pose if what == "poses" else TeachingService.forget_pallet
    request = requests.forget(name) if what == "poses" else requests.forget_pallet(name)
    _asked(settings, lambda client: client.ask(request), lambda teaching: forget(teaching, name))
    return output.answer({"forgotten": name}, translate("Removed: {name}", settings.language, name=name), settings)


def rename(what: str, old: str, new: str, settings: OutputSettings) -> int:
    """Rename a pose or a pallet; raises `NotTaught`, `NameTaken` and `InvalidValue`."""
    change = TeachingService.rename_pose if what == "poses" else TeachingService.rename_pallet
    request = requests.rename(old, new) if what == "poses" else requests.rename_pallet(old, new)
    value = _asked(settings, lambda client: client.ask(request), lambda teaching: change(teaching, old, new))
    return output.answer(value, translate("{old} is now {new}.", settings.language, old=old, new=new), settings)


def pallets(settings: OutputSettings) -> int:
    """List all taught pallets."""
    found = _asked(settings, lambda client: client.ask(requests.pallets()), TeachingService.pallets)
    lines = [_pallet_text(pallet, settings.language, units_of(settings)) for pallet in found]
    text = "\n".join(lines) or translate(
        "No pallets have been taught; teach one with `maya teach-pallet`.", settings.language
    )
    return output.answer({"pallets": found}, text, settings)


def teach_pallet(grid: PalletRequest, settings: OutputSettings, *, replacing: bool) -> int:
    """Store a pallet under its name; without corners, prompt for each corner and store it as a pose.

    Raises the errors of teaching poses, and `InvalidValue` for corners that span no grid.
    """
    try:
        check_counts(grid.rows, grid.columns, len(grid.corners) or 4)
    except ValueError as error:
        raise InvalidCommandLine(reason=str(error), command="maya teach-pallet") from error
    corners = list(grid.corners) or _driven_to(grid, settings, replacing)
    body: dict[str, object] = {"corners": corners, "rows": grid.rows, "columns": grid.columns}
    pallet = _asked(
        settings,
        lambda client: client.ask(requests.teach_pallet(grid.name, body, replace=replacing)),
        lambda teaching: teaching.teach_pallet(grid.name, body, now(), replacing=replacing),
    )
    return output.answer(pallet, _pallet_text(pallet, settings.language, units_of(settings)), settings)


def _driven_to(grid: PalletRequest, settings: OutputSettings, replacing: bool) -> list[str]:
    """Return the names of the poses at the corners; for an empty line, the current position is taught as a pose.

    A line with a name selects that pose instead; `-` omits the last of four corners, which three corners imply.
    """
    client = ServiceClient.find()
    _require_free(client, checked_name(grid.name), replacing)
    names: list[str] = []
    for number, (row, column) in enumerate(_corners(grid)):
        optional = number == 3
        said = _heard(
            translate(
                "Drive the gripper to the last cell [{row},{column}] and press Enter, type the name of a taught "
                "pose, or type - to skip it:"
                if optional
                else "Drive the gripper to cell [{row},{column}] and press Enter, or type the name of a taught pose:",
                settings.language,
                row=row,
                column=column,
            )
        )
        if optional and said == "-":
            break
        name = said or f"{grid.name}.{row}-{column}"
        if not said:
            pose = _taught(client, name, replacing)
            _aside(_said(pose, settings.language, units_of(settings)), settings)
        names.append(name)
    return names


def _require_free(client: ServiceClient, name: str, replacing: bool) -> None:
    """Raise `NameTaken` before a person moves the robot."""
    known = (place["name"] for request in (requests.poses(), requests.pallets()) for place in client.ask(request))
    if not replacing and name in known:
        raise NameTaken(name=name)


def _corners(grid: PalletRequest) -> list[tuple[int, int]]:
    """Return the cells at the corners of a grid in reading order, each once."""
    cells = ((1, 1), (1, grid.columns), (grid.rows, 1), (grid.rows, grid.columns))
    return list(dict.fromkeys(cells))


def _heard(question: str) -> str:
    """Return a line typed by a person, with the prompt on standard error; the end of input ends the command."""
    print(question, file=sys.stderr, end=" ", flush=True)
    try:
        return input().strip()
    except EOFError:
        raise KeyboardInterrupt from None


def _aside(text: str, settings: OutputSettings) -> None:
    if not settings.json:
        output.say(text)


def _taught(client: ServiceClient, name: str, replacing: bool) -> dict[str, Any]:
    return client.ask(requests.teach(name, replace=replacing))


def _asked(
    settings: OutputSettings, there: Callable[[ServiceClient], Any], here: Callable[[TeachingService], object]
) -> Any:
    """Return the answer of the running robot, or without one that of the file of taught places."""
    client = ServiceClient.running()
    if client is not None:
        return there(client)
    config = configuration(settings)
    store = PoseStore(Mechanism.of(config), taught_places(settings))
    return to_data(here(TeachingService(store, config.cell.grasp_height, _nowhere)))


def _nowhere() -> NoReturn:
    raise ServiceNotRunning


def _listed(found: Sequence[Mapping[str, Any]], language: str, units: OutputUnits) -> str:
    if not found:
        return translate("No poses have been taught; teach one with `maya teach NAME`.", language)
    head = tuple(
        translate(text, language, unit=units.of_length)
        for text in (marked("name"), marked("place [{unit}]"), marked("joints"), marked("taught"))
    )
    rows = [(pose["name"], units.place(pose["point"]), units.joints(pose["joints"]), pose["taught"]) for pose in found]
    return table(head, rows)


def _said(pose: Mapping[str, Any], language: str, units: OutputUnits) -> str:
    place = f"{units.place(pose['point'])} {units.of_length}   {units.joints(pose['joints'])}"
    return translate("Taught {name}: {place}", language, name=pose["name"], place=place)


def _pallet_text(pallet: Mapping[str, Any], language: str, units: OutputUnits) -> str:
    size = {"name": pallet["name"], "rows": pallet["rows"], "columns": pallet["columns"]}
    grid = translate("{name}, {rows} x {columns}", language, **size)
    remarks = [translate_phrase(remark, language) for remark in pallet["remarks"]]
    if pallet["corners"] is None:
        return "\n".join((grid, *remarks))
    first, last = pallet["corners"][0], pallet["corners"][3]
    lines = [f"{grid}: {units.place(first)} … {units.place(last)} {units.of_length}"]
    if remarks:
        lines.append(f"  {translate('not quite a rectangle', language)}: {'; '.join(remarks)}")
    return "\n".join(lines)
