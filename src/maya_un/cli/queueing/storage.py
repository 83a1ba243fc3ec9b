"""`maya queue backup|restore|export`: the file of the queue and its history."""

from __future__ import annotations

from pathlib import Path

from dmc41x3.files import replacing
from dmc41x3.i18n import translate
from maya_un.cli import output
from maya_un.cli.settings import OutputSettings
from maya_un.config.state_folder import queue_file
from maya_un.errors import InvalidValue
from maya_un.process.journal import history
from maya_un.schema.encoding import to_data


def backup(target: str, settings: OutputSettings) -> int:
    """Copy the file to `target`, also while it is in use; raises the errors of `history.make`."""
    made = history.make(queue_file(), Path(target))
    return output.answer(
        to_data(made),
        translate(
            "{path}: {jobs} jobs, {unfinished} of them unfinished, {size} kB.", settings.language, **_shown(made)
        ),
        settings,
    )


def restore(source: str, settings: OutputSettings) -> int:
    """Replace the file by a backup, and rename the old file; raises `StorageInUse` while `maya up` runs."""
    done = history.restore(Path(source), queue_file())
    aside = done.aside or translate("nothing", settings.language)
    text = translate(
        "{path}: {jobs} jobs, {unfinished} of them unfinished. The former file is kept as {aside}\n"
        "Users and tokens are those of the backup, too: revoke again what was revoked since (`maya user tokens`).",
        settings.language,
        **{**_shown(done), "aside": aside},
    )
    return output.answer(to_data(done), text, settings)


def export(target: str, settings: OutputSettings) -> int:
    """Write all jobs to `target`, as .csv or .jsonl; raises `InvalidValue` for another ending."""
    path = Path(target)
    ending = path.suffix.removeprefix(".").lower()
    if ending not in set(history.ExportFormat):
        raise InvalidValue(key="FILE", value=repr(target), reason="it must end in .csv or .jsonl")
    with replacing(path, newline="") as out:
        count = history.export(queue_file(), out, history.ExportFormat(ending))
    text = translate("{path}: {jobs} jobs.", settings.language, path=path, jobs=count)
    return output.answer({"path": str(path), "jobs": count}, text, settings)


def _shown(done: history.Backup) -> dict[str, object]:
    size = -(-done.size // 1024)
    return {"path": done.path, "jobs": done.jobs, "unfinished": done.unfinished, "size": size}
