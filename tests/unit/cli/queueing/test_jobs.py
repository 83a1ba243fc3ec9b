"""`maya job` and `maya history`."""

from __future__ import annotations

import csv
import io
import json
import os
import re
import shutil
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import pytest

from tests.unit.cli.queueing.answers import LINE, VIEW, Service, Several, printed, running

Serve = Callable[..., Service]

REPORT: dict[str, Any] = {
    "id": 7, "name": "two cubes", "state": "done", "code": 0, "message": "", "predicted": 61.0, "duration": 63.5,
    "lowest": 0.4, "highest": 0.9, "parts": {}, "remarks": [],
    "steps": [
        {
            "index": 1, "key": "steps.0", "step": "home", "state": "done", "code": 0, "message": "", "predicted": None,
            "duration": 63.5, "end_counts": None, "end_point": None, "phase": "",
        }
    ],
    "line": {**LINE, "state": "done", "notes": "for berta", "began": "2026-03-01T10:00:01+00:00"},
}  # fmt: skip


@pytest.fixture
def serve(monkeypatch: pytest.MonkeyPatch) -> Iterator[Serve]:
    """Return what serves answers by path until the test ends."""
    with ExitStack() as stack:
        yield lambda **answers: stack.enter_context(running(Service(**answers), monkeypatch))


@pytest.fixture
def file(tmp_path: Path) -> str:
    place = tmp_path / "mine.yaml"
    place.write_text("steps: [home]\n", encoding="utf-8")
    return str(place)


def test_job_is_submitted_with_its_options(serve: Serve, capsys: pytest.CaptureFixture[str], file: str) -> None:
    service = serve(**{"/v1/jobs": {"id": 7, "name": "mine", "steps": 1}})
    line = "--priority 5 --held --after 3 --after 4 --notes a&b --on-failure pause --retries 2 --stepwise"
    assert printed(["job", "submit", file, *line.split()], capsys) == "Job 7, mine: 1 steps.\n"
    ((_, path, body),) = service.said
    assert path == (
        "/v1/jobs?priority=5&held=true&depends_on=3&depends_on=4&notes=a%26b&on_failure=pause&retries=2&stepwise=true"
    )
    assert body["name"] == "mine"
    assert body["steps"] == [{"home": True}]


def test_submission_that_does_not_begin_by_itself_gives_the_reason(
    serve: Serve, capsys: pytest.CaptureFixture[str], file: str
) -> None:
    proposal = {**LINE, "state": "held", "proposal": True}
    serve(**{"/v1/jobs": {"id": 7, "name": "mine", "steps": 1}, "/v1/queue": {**VIEW, "waiting": [proposal]}})
    said = printed(["job", "submit", file], capsys).splitlines()
    assert said == [
        "Job 7, mine: 1 steps.",
        "Job 7 is a proposal. An operator approves it with `maya job release 7`.",
    ]


def test_default_submission_sends_no_options(serve: Serve, capsys: pytest.CaptureFixture[str], file: str) -> None:
    service = serve(**{"/v1/jobs": {"id": 7, "name": "mine", "steps": 1}})
    printed(["job", "submit", file], capsys)
    assert service.said[0][1] == "/v1/jobs"


def test_submission_can_be_followed_and_shows_its_dependencies(
    serve: Serve, capsys: pytest.CaptureFixture[str], file: str
) -> None:
    paused = {**VIEW, "mode": "paused", "reason": "asked", "by": "berta", "waiting": [LINE]}
    news = [{"seq": 41, "time": 0.0, "kind": "job", "code": 0, "detail": {"job": 7}}]
    serve(
        **{
            "POST /v1/jobs": {"id": 7, "name": "two cubes", "steps": 1},
            "/v1/jobs/7": [Several({**REPORT, "state": "queued"}), Several(REPORT)],
            "/v1/queue": paused,
            "/v1/events": [Several([]), Several(news)],
        }
    )
    said = printed(["job", "submit", file, "--wait"], capsys)
    assert said.count("Job 7 waits: the queue is paused (berta paused it).") == 1
    assert "two cubes: done in 63.5 s" in said


@pytest.mark.parametrize(
    ("report", "answers", "words"),
    [
        ("held", {"/v1/queue": {**VIEW, "waiting": [{**LINE, "proposal": True}]}}, "is a proposal. An operator"),
        ("held", {}, "Job 7 is held. `maya job release 7`"),
        ("interrupted", {"/v1/queue": {**VIEW, "recovery": {"job": 7}}}, "job 7 was interrupted"),
        (
            "queued",
            {
                "/v1/queue": {**VIEW, "waiting": [LINE]},
                "/v1/lease": {"holder": "berta", "implicit": False, "yours": False, "since": 12.4},
            },
            "berta drives",
        ),
        ("queued", {"/v1/queue": {**VIEW, "waiting": [LINE], "running": {"id": 3}}}, "its turn, number 1."),
    ],
)
def test_every_reason_to_wait_has_its_words(
    serve: Serve, capsys: pytest.CaptureFixture[str], report: str, answers: dict[str, Any], words: str
) -> None:
    news = [{"seq": 41, "time": 0.0, "kind": "job", "code": 0, "detail": {"job": 7}}]
    reports = [Several({**REPORT, "state": report}), Several(REPORT)]
    serve(**{"POST /v1/tasks": REPORT, "/v1/jobs/7": reports, "/v1/events": news, **answers})
    assert words in printed(["home"], capsys)


def test_automatic_continuation_prints_nothing_of_waiting(serve: Serve, capsys: pytest.CaptureFixture[str]) -> None:
    news = [{"seq": 41, "time": 0.0, "kind": "job", "code": 0, "detail": {"job": 7}}]
    reports = [Several({**REPORT, "state": "queued"}), Several(REPORT)]
    serve(**{"POST /v1/tasks": REPORT, "/v1/jobs/7": reports, "/v1/events": news})
    assert printed(["home"], capsys) == "Done.\n"


def test_job_is_shown_step_by_step_with_its_submitter(serve: Serve, capsys: pytest.CaptureFixture[str]) -> None:
    serve(**{"/v1/jobs/7": REPORT})
    said = printed(["job", "show", "7"], capsys)
    assert "two cubes: done in 63.5 s; gripper between 400.0 mm and 900.0 mm" in said
    assert "asked for by ana (10.0.0.7) at" in said
    assert said.endswith("for berta\n")
    assert json.loads(printed(["job", "show", "7", "--json"], capsys)) == REPORT


@pytest.mark.parametrize(
    ("line", "asked", "said"),
    [
        ("hold 7", ("POST", "/v1/jobs/7/hold", None), "Job 7, two cubes: held.\n"),
        ("notes 7 hello", ("PATCH", "/v1/jobs/7", {"notes": "hello"}), "Job 7, two cubes: held.\n"),
        ("cancel 7", ("DELETE", "/v1/jobs/7", None), "Job 7, two cubes: held.\n"),
        ("again 7", ("POST", "/v1/jobs/7/again", {}), "Job 7, two cubes: held. It repeats job 7.\n"),
        (
            "again 7 --from 3",
            ("POST", "/v1/jobs/7/again", {"from_step": 3}),
            "Job 7, two cubes: held. It repeats job 7.\n",
        ),
        (
            "edit 7 --priority 3 --no-stepwise --after 5",
            ("PATCH", "/v1/jobs/7", {"priority": 3, "stepwise": False, "depends_on": [5]}),
            "Job 7, two cubes: held.\n",
        ),
    ],
)
def test_job_is_printed(
    serve: Serve, capsys: pytest.CaptureFixture[str], line: str, asked: tuple[str, str, Any], said: str
) -> None:
    service = serve(**{asked[1]: {**LINE, "state": "held"}})
    assert printed(["job", *line.split()], capsys) == said
    assert service.said == [asked]


@pytest.mark.parametrize(("said", "version"), [([], "ab12"), (["--version", "cd34"], "cd34")])
def test_a_proposal_is_approved_as_it_was_seen(
    serve: Serve, capsys: pytest.CaptureFixture[str], said: list[str], version: str
) -> None:
    released = {**LINE, "state": "queued", "proposal": True, "approved_by": "eva"}
    report = {**REPORT, "version": "ab12"}
    service = serve(**{"/v1/jobs/7": report, "/v1/jobs/7/release": released})
    shown = printed(["job", "release", "7", *said], capsys)
    assert shown.startswith("You approved this job of ana:\n    1  ")
    assert shown.endswith("Job 7, two cubes: queued.\n")
    assert service.said == [("POST", f"/v1/jobs/7/release?version={version}", None)]


def test_held_job_is_released_with_a_short_message(serve: Serve, capsys: pytest.CaptureFixture[str]) -> None:
    serve(**{"/v1/jobs/7": {**REPORT, "version": "ab12"}, "/v1/jobs/7/release": {**LINE, "state": "queued"}})
    assert printed(["job", "release", "7"], capsys) == "Job 7, two cubes: queued.\n"


def test_proposal_shows_the_command_that_approves_this_version(
    serve: Serve, capsys: pytest.CaptureFixture[str]
) -> None:
    line = {**LINE, "state": "held", "proposal": True}
    serve(**{"/v1/jobs/7": {**REPORT, "state": "held", "line": line, "version": "ab12"}})
    said = printed(["job", "show", "7"], capsys)
    assert said.endswith("An operator approves this version with: maya job release 7 --version ab12\n")


SEEN = {**LINE, "version": "abc"}
"""The report of a job, as far as an editor of the job needs it."""


def edited(monkeypatch: pytest.MonkeyPatch, tmp_path: Path, script: str) -> None:
    """Have somebody at a terminal, with an editor that changes the file like this."""
    monkeypatch.setattr(sys.stdin, "isatty", lambda: True)
    editor = tmp_path / "editor"
    editor.write_text(f"#!/bin/sh\n{script}\n", encoding="utf-8")
    editor.chmod(0o755)
    monkeypatch.setenv("VISUAL", str(editor))


def test_without_options_a_job_is_opened_in_the_editor(
    serve: Serve, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    edited(monkeypatch, tmp_path, 'sed -i "s/open/close/" "$1"')
    body = {"name": "mine", "steps": ["home", {"gripper": "open"}]}
    service = serve(**{"/v1/jobs/7/body": body, "GET /v1/jobs/7": SEEN, "PATCH /v1/jobs/7": LINE})
    assert printed(["job", "edit", "7"], capsys) == "Job 7, two cubes: queued.\n"
    ((_, path, changes),) = service.said
    assert path == "/v1/jobs/7?version=abc"
    assert changes["job"]["steps"] == [{"home": True}, {"gripper": "close"}]
    assert changes["job"]["name"] == "mine"


def test_unchanged_edit_changes_nothing(
    serve: Serve, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    edited(monkeypatch, tmp_path, "exit 0")
    service = serve(**{"/v1/jobs/7/body": {"name": "mine", "steps": ["home"]}, "/v1/jobs/7": SEEN})
    assert printed(["job", "edit", "7"], capsys) == "Nothing was changed.\n"
    assert service.said == []


@pytest.mark.parametrize("script", ["exit 3", 'echo "steps: [fly]" > "$1"'])
def test_an_editor_that_fails_or_leaves_no_job_changes_nothing(
    serve: Serve, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path, script: str
) -> None:
    edited(monkeypatch, tmp_path, script)
    service = serve(**{"/v1/jobs/7/body": {"name": "mine", "steps": ["home"]}, "/v1/jobs/7": SEEN})
    told = printed(["job", "edit", "7"], capsys, 2)
    assert "maya: error " in told
    assert service.said == []
    kept = re.fullmatch(r"(?s)Your text is kept\. Correct it, then run `maya job edit 7 --file (\S+)`\.\n.*", told)
    assert (kept is None) == script.startswith("exit")
    assert kept is None or Path(kept[1]).read_text(encoding="utf-8") == "steps: [fly]\n"


def test_a_job_that_is_not_saved_as_utf_8_is_kept(
    serve: Serve, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    edited(monkeypatch, tmp_path, r"""printf 'name: caf\351\n' > "$1" """)
    service = serve(**{"/v1/jobs/7/body": {"name": "mine", "steps": ["home"]}, "/v1/jobs/7": SEEN})
    told = printed(["job", "edit", "7"], capsys, 2)
    assert "it is not UTF-8 text" in told
    assert service.said == []
    kept = re.search(r"`maya job edit 7 --file (\S+)`", told)
    assert kept is not None
    assert Path(kept[1]).read_bytes() == b"name: caf\xe9\n"
    shutil.rmtree(Path(kept[1]).parent)


@pytest.mark.parametrize("script", ['rm "$1"', 'rm -r "$(dirname "$1")"'])
def test_a_file_that_the_editor_deleted_is_an_error_and_nothing_is_kept(
    serve: Serve, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path, script: str
) -> None:
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "temporary"))
    (tmp_path / "temporary").mkdir()
    edited(monkeypatch, tmp_path, script)
    service = serve(**{"/v1/jobs/7/body": {"name": "mine", "steps": ["home"]}, "/v1/jobs/7": SEEN})
    told = printed(["job", "edit", "7"], capsys, 2)
    assert re.match(r"maya: error 4007: Reading \S+ failed: No such file or directory\.", told)
    assert service.said == []
    assert list((tmp_path / "temporary").iterdir()) == []


@pytest.mark.parametrize("name", ["VISUAL", "EDITOR"])
def test_an_editor_with_an_open_quote_is_named(
    serve: Serve, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path, name: str
) -> None:
    edited(monkeypatch, tmp_path, "exit 0")
    monkeypatch.delenv("VISUAL")
    monkeypatch.setenv(name, "vi '")
    serve(**{"/v1/jobs/7/body": {"name": "mine", "steps": ["home"]}, "/v1/jobs/7": SEEN})
    told = printed(["job", "edit", "7"], capsys, 2)
    assert f"{name} = vi ' is not valid: No closing quotation." in told


def test_no_editor_is_opened_for_a_job_that_has_ended(
    serve: Serve, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    edited(monkeypatch, tmp_path, f"touch {tmp_path}/opened")
    serve(**{"/v1/jobs/7": {**LINE, "state": "done"}})
    assert "4014" in printed(["job", "edit", "7"], capsys, 2)
    assert not (tmp_path / "opened").exists()


def test_without_a_terminal_no_editor_opens(
    serve: Serve, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    edited(monkeypatch, tmp_path, f"touch {tmp_path}/opened")
    monkeypatch.setattr(sys.stdin, "isatty", lambda: False)
    service = serve()
    assert "give the options to change" in printed(["job", "edit", "7"], capsys, 2)
    assert service.asked == []
    assert not (tmp_path / "opened").exists()


PAST = [
    {
        **LINE,
        "id": number,
        "state": "done",
        "done": 5,
        "duration": 3725.0,
        "submitted": f"2026-03-01T1{number}:00:00+00:00",
    }
    for number in (3, 2, 1)
]


def test_history_shows_prediction_duration_and_origin(
    serve: Serve, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(os.environ, "TZ", "UTC")
    serve(**{"/v1/jobs": [Several(PAST), Several([])]})
    rows = [line.split() for line in printed(["history"], capsys).splitlines()]
    assert len(rows) == 4
    assert rows[1][:9] == ["3", "two", "cubes", "done", "5/5", "1:01", "min", "1:02:05", "h"]
    assert rows[1][-2:] == ["ana", "10.0.0.7"]


def test_unpredictable_time_is_not_shown_as_zero(serve: Serve, capsys: pytest.CaptureFixture[str]) -> None:
    homing = {**LINE, "state": "done", "done": 5, "predicted": 0.0, "duration": 65.0}
    serve(**{"/v1/jobs": [Several([homing]), Several([])]})
    row = printed(["history"], capsys).splitlines()[1].split()
    assert row[5:8] == ["–", "1:05", "min"]


def test_history_is_requested_with_its_filters(serve: Serve, capsys: pytest.CaptureFixture[str]) -> None:
    service = serve(**{"/v1/jobs": [Several([])]})
    line = ["history", "5", "--owner", "ana", "--state", "done", "--state", "failed", "--text", "a b"]
    assert printed(line, capsys) == "Nothing has been done yet.\n"
    assert service.asked == [("GET", "/v1/jobs?state=done&state=failed&owner=ana&text=a+b&limit=5", None)]


@pytest.mark.parametrize("option", ["--state", "--owner", "--text"])
def test_history_option_with_invalid_utf8_is_sent_unchanged(
    option: str, serve: Serve, capsys: pytest.CaptureFixture[str]
) -> None:
    service = serve(**{"/v1/jobs": [Several([])]})
    assert printed(["history", option, os.fsdecode(b"\xff")], capsys) == "Nothing has been done yet.\n"
    (asked,) = service.asked
    assert f"{option.removeprefix('--')}=%ED%B3%BF" in asked[1]


def test_a_long_history_is_read_page_after_page(serve: Serve, capsys: pytest.CaptureFixture[str]) -> None:
    service = serve(**{"/v1/jobs": [Several(PAST), Several(PAST[:1]), Several([])]})
    assert len(json.loads(printed(["history", "10", "--json"], capsys))["jobs"]) == 4
    assert [path for _, path, _ in service.asked] == [
        "/v1/jobs?limit=10", "/v1/jobs?below=1&limit=7", "/v1/jobs?below=3&limit=6",
    ]  # fmt: skip


def test_as_csv_every_field_is_a_column(serve: Serve, capsys: pytest.CaptureFixture[str]) -> None:
    serve(**{"/v1/jobs": [Several([{**PAST[0], "depends_on": [1, 2], "notes": 'a, "b"'}]), Several([])]})
    (row,) = csv.DictReader(io.StringIO(printed(["history", "--csv"], capsys)))
    assert row.keys() == LINE.keys()
    assert (row["id"], row["depends_on"], row["notes"]) == ("3", "1 2", 'a, "b"')


def test_csv_and_json_have_the_same_content(serve: Serve, capsys: pytest.CaptureFixture[str]) -> None:
    serve()
    assert json.loads(printed(["history", "--csv", "--json"], capsys, 2))["error"]["code"] == 4008
