"""The statements of jobs as people write them: accepted forms, refusals with their places, and the way back to text."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from maya_un.config import Config
from maya_un.config.files import parse
from maya_un.errors import InvalidConfig, InvalidJob
from maya_un.process.outlook import require_channels
from maya_un.process.spec.documents import write_yaml
from maya_un.process.spec.job import IfElse, Job, Step, load_job
from maya_un.process.spec.poses import TaughtPlaces
from maya_un.process.spec.statements import LONGEST, STATEMENTS, AskOperator, SetOutput, Wait, WaitFor
from maya_un.process.spec.stored import expanded, write_job
from maya_un.process.spec.tasks import Task, expand
from maya_un.robot.primitives.pick import Pick

HEIGHT = 0.4
CHANNELS = parse({"controller": {"outputs": [3, 5], "output_names": ["", "", "vacuum"], "input_names": ["door"]}})


def tasks_of(*steps: Any, **more: Any) -> tuple[Task, ...]:
    """Return the tasks of a job of these steps."""
    return expand(Job.parse({"steps": list(steps), **more}), HEIGHT).tasks


def action_of(step: Any) -> Any:
    """Return the action of a job of one step."""
    (task,) = tasks_of(step)
    return task.action


channels = st.integers(1, 8) | st.from_regex(r"[a-z][a-z0-9_-]{0,20}", fullmatch=True)
levels = st.sampled_from(["on", "off", True, False])
seconds = st.floats(1e-3, LONGEST, allow_nan=False)
lines = st.text(st.characters(codec="utf-8", categories=("L", "N", "P")), min_size=1, max_size=30)
statements = st.one_of(
    seconds.map(lambda time: {"wait": time}),
    st.builds(lambda output, to: {"set": {"output": output, "to": to}}, channels, levels),
    st.builds(lambda one, level: {"wait_for": {"input": one, "is": level}}, channels, levels),
    st.builds(
        lambda one, level, within: {"wait_for": {"input": one, "is": level, "within": within}},
        channels,
        levels,
        seconds,
    ),
    lines.map(lambda question: {"ask": question}),
    st.builds(
        lambda question, choices: {"ask": {"question": question, "choices": choices}},
        lines,
        st.lists(lines, min_size=1, max_size=6, unique=True),
    ),
)


conditions = st.builds(lambda one, level: {"input": one, "is": level}, channels, levels)
steps = st.recursive(
    st.lists(statements, min_size=1, max_size=3),
    lambda inner: st.lists(
        st.builds(lambda one, then, other: {"if": one, "then": then, "else": other}, conditions, inner, inner)
        | st.builds(lambda one, then: {"if": one, "then": then}, conditions, inner),
        min_size=1,
        max_size=2,
    ),
    max_leaves=6,
).map(lambda found: [*found, {"for_each": "row", "do": found}])
ROW = {"row": {"corners": [[0.3, 1.0], [0.5, 1.0]], "rows": 1, "columns": 2}}


@given(steps)
def test_branches_are_read_back_and_their_tasks_are_ranges_within_each_other(found: list[Any]) -> None:
    job = Job.parse({"steps": found, "pallets": ROW})
    assert Job.parse(job.as_data()) == job
    tasks = expand(job, HEIGHT).tasks
    assert [task.index for task in tasks] == list(range(1, len(tasks) + 1))
    for task in tasks:
        inner = [*task.branch("then"), *task.branch("else")]
        assert inner == list(range(task.index + 1, task.index + 1 + task.branches))
        assert all(tasks[index - 1].key.startswith(f"{task.key}.then") for index in task.branch("then"))
        assert all(tasks[index - 1].key.startswith(f"{task.key}.else") for index in task.branch("else"))
        assert task.index + task.branches <= len(tasks)


def test_a_part_keeps_its_place_after_branches_that_agree() -> None:
    parts = {"parts": {"cube": [0.5, 1.1], "box": [0.7, 1.1]}, "places": {"tray": [1.1, 0.5], "mat": [1.0, 0.7]}}
    carry = [{"pick": "cube"}, {"place": "tray"}]
    same = {"if": {"input": 1, "is": "on"}, "then": carry, "else": [{"wait": 1}, *carry]}
    found = expand(Job.parse({"steps": [same, {"pick": "cube"}], **parts}), HEIGHT)
    last = found.tasks[-1].action
    assert isinstance(last, Pick)
    assert last.target == pytest.approx((1.1, 0.5, HEIGHT))
    other = {"if": {"input": 1, "is": "on"}, "then": [{"pick": "cube"}], "else": [{"pick": "box"}]}
    assert expand(Job.parse({"steps": [other], **parts}), HEIGHT).parts == {"cube": None, "box": None}


NESTED = {"if": {"input": 1, "is": "on"}, "then": [{"for_each": "row", "do": ["home"]}]}


@pytest.mark.parametrize(
    ("found", "key"),
    [
        ({"for_each": "row", "do": [NESTED]}, "steps.1.do.0.then.0"),
        ({"if": {"input": 3}, "then": ["home"]}, "steps.1.if"),
        ({"if": {"input": 3, "is": "on", "answer": "yes"}, "then": ["home"]}, "steps.1.if"),
        ({"if": {"input": 3, "is": "on"}, "then": []}, "steps.1.then"),
        ({"if": {"input": 3, "is": "on"}}, "steps.1.then"),
        ({"if": {"input": 3, "is": "on"}, "then": ["home"], "otherwise": []}, "steps.1.otherwise"),
        ({"if": {"input": 3, "is": "on"}, "then": [{"wait": 1}, {"wait": 0}]}, "steps.1.then.1.wait"),
        ({"if": {"answer": "perhaps"}, "then": ["home"]}, "steps.1.if"),
        (
            {"for_each": "row", "do": [{"if": {"input": 1, "is": "on"}, "then": [{"wait": 0}]}]},
            "steps.1.do.0.then.0.wait",
        ),
    ],
)
def test_branches_are_refused_with_their_place(found: Any, key: str) -> None:
    with pytest.raises(InvalidJob) as refused:
        expand(
            Job.parse({"steps": [{"ask": {"question": "?", "choices": ["yes", "no"]}}, found], "pallets": ROW}), HEIGHT
        )
    assert refused.value.details["key"] == key


def test_a_question_within_a_branch_does_not_count_behind_it() -> None:
    ask = {"if": {"input": 1, "is": "on"}, "then": [{"ask": {"question": "?", "choices": ["yes", "no"]}}]}
    with pytest.raises(InvalidJob):
        expand(Job.parse({"steps": [ask, {"if": {"answer": "yes"}, "then": ["home"]}]}), HEIGHT)


def test_steps_that_are_nested_too_deeply_are_refused() -> None:
    found: list[Any] = ["home"]
    for _ in range(2_000):
        found = [{"if": {"input": 1, "is": "on"}, "then": found}]
    with pytest.raises(InvalidJob):
        Job.parse({"steps": found})


@given(st.lists(statements, min_size=1, max_size=8))
def test_a_job_of_statements_is_read_back_from_its_data_and_from_its_text(steps: list[Any]) -> None:
    job = Job.parse({"steps": steps})
    assert Job.parse(job.as_data()) == job
    assert Job.parse(yaml.safe_load(write_yaml(job.as_data()))) == job
    stored = write_job(job, HEIGHT, TaughtPlaces)
    assert [task.action for task in expanded(stored.body, HEIGHT).tasks] == [
        task.action for task in stored.expansion.tasks
    ]


@given(st.lists(statements, min_size=1, max_size=5), st.integers(1, 4))
def test_statements_count_in_every_round_and_change_no_part(steps: list[Any], rounds: int) -> None:
    job = Job.parse({"parts": {"cube": [0.5, 1.1]}, "steps": steps, "repeat": rounds})
    found = expand(job, HEIGHT)
    assert [task.index for task in found.tasks] == list(range(1, len(steps) * rounds + 1))
    assert found.parts == found.start


@given(
    st.floats() | st.integers() | st.text(max_size=8) | st.booleans() | st.none() | st.lists(st.integers(), max_size=2)
)
def test_wait_accepts_exactly_durations_up_to_a_day(value: Any) -> None:
    try:
        wait = action_of({"wait": value})
    except InvalidJob as refused:
        assert str(refused.details["key"]).startswith("steps.0")
        return
    assert isinstance(wait, Wait)
    assert 0.0 < wait.seconds <= LONGEST


@pytest.mark.parametrize(
    ("step", "action", "label"),
    [
        ({"wait": "2 s"}, Wait(seconds=2.0), "wait 2 s"),
        ({"wait": "1.5 min"}, Wait(seconds=90.0), "wait 90 s"),
        ({"wait": {"seconds": 3}}, Wait(seconds=3.0), "wait 3 s"),
        ({"set": {"output": "vacuum", "to": True}}, SetOutput(output="vacuum", to="on"), "set vacuum on"),
        ({"ask": "Full?"}, AskOperator(question="Full?"), "ask Full?"),
        (
            {"ask": {"question": "Full?", "choices": [True, False]}},
            AskOperator(question="Full?", choices=("yes", "no")),
            "ask Full?",
        ),
        (
            {"wait_for": {"input": 3, "is": False, "within": "10 s"}},
            WaitFor.model_validate({"input": 3, "is": "off", "within": 10.0}),
            "wait_for 3 off",
        ),
    ],
)
def test_statements_accept_short_forms_units_and_booleans_of_yaml(step: Any, action: Any, label: str) -> None:
    (task,) = tasks_of(step)
    assert (task.action, task.label) == (action, label)


@pytest.mark.parametrize(
    ("step", "key"),
    [
        ({"wait": 0}, "steps.0.wait"),
        ({"wait": "2 m"}, "steps.0.wait"),
        ({"wait": "2 d"}, "steps.0.wait"),
        ({"wait": None}, "steps.0"),
        ({"set": {"output": 3}}, "steps.0.set.to"),
        ({"set": {"output": 9, "to": "on"}}, "steps.0.set.output"),
        ({"set": {"output": True, "to": "on"}}, "steps.0.set.output"),
        ({"set": {"output": 3, "to": "high"}}, "steps.0.set.to"),
        ({"set": {"output": 3, "to": "on", "for": 2}}, "steps.0.set.for"),
        ({"wait_for": {"input": 3, "is": "on", "within": 0}}, "steps.0.wait_for.within"),
        ({"ask": ""}, "steps.0.ask"),
        ({"ask": "two\nlines"}, "steps.0.ask"),
        ({"ask": {"question": "?", "choices": []}}, "steps.0.ask.choices"),
        ({"ask": {"question": "?", "choices": ["a", "a"]}}, "steps.0.ask"),
        ({"line": [1, 1], "speed": 0}, "steps.0.speed"),
        ({"line": [1, 1], "speed": "150 %"}, "steps.0.speed"),
        ({"home": True, "speed": 0.5}, "steps.0"),
        ({"wait": 1, "speed": 0.5}, "steps.0"),
        ({"wait": 1, "set": {"output": 3, "to": "on"}}, "steps.0"),
    ],
)
def test_bad_values_are_refused_with_their_place(step: Any, key: str) -> None:
    with pytest.raises(InvalidJob) as refused:
        Job.parse({"steps": [step]})
    assert refused.value.details["key"] == key


def test_a_refusal_names_line_and_column_of_the_file(tmp_path: Path) -> None:
    path = tmp_path / "job.yaml"
    path.write_text("steps:\n  - home\n  - wait_for:\n      input: 3\n      is: maybe\n", encoding="utf-8")
    with pytest.raises(InvalidJob) as refused:
        load_job(path)
    assert (refused.value.details["line"], refused.value.details["column"]) == (5, 7)


@given(st.sampled_from([0.01, 0.25, 0.5, 1.0]))
def test_speed_is_a_share_in_numbers_or_percent(share: float) -> None:
    one, other = tasks_of({"line": [1, 1], "speed": share}, {"line": [1, 1], "speed": f"{share * 100:g} %"})
    assert one.speed == other.speed == pytest.approx(share)
    assert one.label == f"line 1 1 at {share:.0%}"


@pytest.mark.parametrize(
    ("step", "key"),
    [
        ({"set": {"output": 4, "to": "on"}}, "steps.0.set.output"),
        ({"set": {"output": "lamp", "to": "on"}}, "steps.0.set.output"),
        ({"wait_for": {"input": "vacuum", "is": "on"}}, "steps.0.wait_for.input"),
    ],
)
def test_channels_are_checked_against_the_configuration(step: Any, key: str) -> None:
    with pytest.raises(InvalidJob) as refused:
        require_channels(tasks_of(step), CHANNELS)
    assert refused.value.details["key"] == key


def test_known_channels_are_accepted_by_number_and_name() -> None:
    require_channels(
        tasks_of(
            {"set": {"output": 3, "to": "on"}},
            {"set": {"output": "vacuum", "to": "off"}},
            {"wait_for": {"input": "door", "is": "on"}},
            {"wait_for": {"input": 8, "is": "on"}},
        ),
        CHANNELS,
    )
    with pytest.raises(InvalidJob):
        require_channels(tasks_of({"set": {"output": 3, "to": "on"}}), Config())


@pytest.mark.parametrize("key", ["output_names", "input_names"])
@pytest.mark.parametrize("names", [["a", "a"], ["1st"], ["a"] * 9])
def test_names_of_channels_are_different_words(key: str, names: list[str]) -> None:
    with pytest.raises(InvalidConfig):
        parse({"controller": {key: names}})


def test_the_jobs_of_the_how_to_page_are_accepted() -> None:
    page = Path(__file__).parents[3] / "docs" / "how-to" / "run-a-job.md"
    found = [part.partition("```")[0] for part in page.read_text(encoding="utf-8").split("```yaml\n")[1:]]
    steps = [step for text in found for step in Job.parse(yaml.safe_load(text)).steps]
    assert {step.command for step in steps if isinstance(step, Step)} >= {"home", *STATEMENTS}
    assert any(isinstance(step, IfElse) for step in steps)


def test_every_statement_has_help_and_a_label() -> None:
    assert {one.command for one in STATEMENTS.values()} == {"wait", "set", "wait_for", "ask"}
    assert all(one.summary for one in STATEMENTS.values())
