"""`maya call`: parameters become those of the generated requests; bad ones are named."""

from __future__ import annotations

import pytest

from maya_un.cli import call
from maya_un.cli.main import main
from maya_un.errors import InvalidCommandLine


@pytest.mark.parametrize(
    ("name", "given", "target", "body"),
    [
        ("reach", ["x=0.5", "y=1.2", "z=4e-1"], "/v1/reach?x=0.5&y=1.2&z=0.4", None),
        ("pause_queue", ["when=now"], "/v1/queue/pause", {"when": "now"}),
        ("teach", ["name=5", "replace=true"], "/v1/poses/5?replace=true", {}),
        ("submit", ['job={"steps":[]}', "depends_on=[3, 4]"], "/v1/jobs?depends_on=3&depends_on=4", {"steps": []}),
        ("forget", ["name=a=b"], "/v1/poses/a%3Db", None),
        ("stop", [], "/v1/stop", None),
    ],
)  # fmt: skip
def test_parameters_are_read_as_the_operation_declares_them(
    name: str, given: list[str], target: str, body: object
) -> None:
    request = call.request_from(name, given)
    assert (request.target, request.body) == (target, body)


@pytest.mark.parametrize(
    ("given", "reason"),
    [
        (["x=1"], "y: reach needs y, z"),
        (["x=1", "y=1", "z=1", "w=1"], "w: reach has the parameters x, y, z"),
        (["x=1", "y=1", "z=high"], "z: it is not of the type float"),
        (["0.5"], "0.5 is not of the form NAME=VALUE"),
    ],
)
def test_bad_parameters_are_named(given: list[str], reason: str) -> None:
    with pytest.raises(InvalidCommandLine) as caught:
        call.request_from("reach", given)
    assert caught.value.details["reason"] == reason


def test_unknown_operation_is_refused_before_anything_is_sent(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["call", "resume-queue"]) == 2
    assert "operation: 'resume-queue' is unknown; `maya call` lists all operations" in capsys.readouterr().err


def test_list_has_every_operation_that_answers_in_json(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["call"]) == 0
    listed = {line.split()[0] for line in capsys.readouterr().out.splitlines() if not line.startswith(" ")}
    assert {"status", "pause_queue", "jog_by", "add_user"} <= listed
    assert not {"prometheus", "recording", "back_up"} & listed
