"""Names in jobs: cells of pallets, loops over them, taught poses."""

from __future__ import annotations

from typing import Any

import pytest

from maya_un.errors import InvalidJob, MayaError, UnknownName
from maya_un.process.spec.job import MOST_TASKS, Grid, Job
from maya_un.process.spec.poses import TaughtPallet, TaughtPlaces
from maya_un.process.spec.tasks import Task, expand, starting_parts
from maya_un.robot.primitives import Approach, MoveJoints, Pick, Place
from maya_un.schema.jobs import TaughtPose
from maya_un.values import Joints, Point

TRAY = {"corners": [[0.3, 1.0], [0.6, 1.0], [0.3, 1.2]], "rows": 3, "columns": 4}
BOX = {"corners": [[1.0, 0.3], [1.2, 0.3]], "rows": 1, "columns": 3}
SHELF = TaughtPose("shelf", Joints(0.4, 1.6, 1.3), Point(0.5, 1.1, 0.62), "")
SLACK = TaughtPose("slack", Joints(0.4, 0.6, 0.6), None, "")
RACK = TaughtPallet("rack", Grid.model_validate({"corners": ["shelf", [0.7, 1.1, 0.62]], "rows": 1, "columns": 2}), "")
TAUGHT = TaughtPlaces({"shelf": SHELF, "slack": SLACK}, {"rack": RACK})


def job(*steps: Any, **changes: Any) -> Job:
    return Job.parse({"pallets": {"tray": TRAY, "box": BOX}, "steps": list(steps), **changes})


def tasks(*steps: Any, **changes: Any) -> tuple[Task, ...]:
    return expand(job(*steps, **changes), 0.4, lambda: TAUGHT).tasks


def labels(*steps: Any, **changes: Any) -> list[str]:
    return [task.label for task in tasks(*steps, **changes)]


def refusal(*steps: Any, **changes: Any) -> MayaError:
    with pytest.raises((InvalidJob, UnknownName)) as caught:
        tasks(*steps, **changes)
    return caught.value


def test_a_cell_is_a_place() -> None:
    pick, place, approach = tasks({"pick": "tray[1,2]"}, {"place": "box[1, 3]"}, {"approach": "tray[3,4]"})
    assert isinstance(pick.action, Pick)
    assert pick.action.target == pytest.approx((0.4, 1.0, 0.4))
    assert place.action == Place(Point(1.2, 0.3, 0.4))
    assert isinstance(approach.action, Approach)
    assert approach.action.target == pytest.approx((0.6, 1.2, 0.4))
    assert [task.label for task in (pick, place)] == ["pick tray[1,2]", "place box[1,3]"]


def test_next_continues_in_every_round_and_counts_pick_and_place_separately() -> None:
    assert labels({"pick": "tray[next]"}, {"place": "box[next]"}, repeat=3) == [
        *("pick tray[1,1]", "place box[1,1]", "pick tray[1,2]", "place box[1,2]", "pick tray[1,3]", "place box[1,3]")
    ]
    assert labels({"pick": "tray[next]"}, {"place": "tray[next]"}, repeat=2) == [
        *("pick tray[1,1]", "place tray[1,1]", "pick tray[1,2]", "place tray[1,2]")
    ]


def test_next_leaves_out_cells_that_the_job_has_been_to() -> None:
    steps = ({"place": "box[1,2]"}, {"place": "box[next]"}, {"place": "box[next]"})
    assert labels(*steps) == ["place box[1,2]", "place box[1,1]", "place box[1,3]"]


def test_a_pallet_that_is_used_up_refuses_the_job() -> None:
    error = refusal({"pick": "tray[next]"}, {"place": "box[next]"}, repeat=4)
    assert error.details["key"] == "steps.1.place"
    assert "all 3 cells of box have had their place already" in str(error)


def test_a_loop_does_its_steps_for_every_cell() -> None:
    moves = {"for_each": "box", "do": [{"pick": "box[each]"}, {"place": "tray[next]"}]}
    assert labels("home", moves) == [
        "home",
        *("pick box[1,1]", "place tray[1,1]", "pick box[1,2]", "place tray[1,2]", "pick box[1,3]", "place tray[1,3]"),
    ]
    first = tasks("home", moves)[1]
    assert (first.index, first.key) == (2, "steps.1.do.0")


@pytest.mark.parametrize(
    ("cells", "gone_to"),
    [
        ("tray[2,*]", ["tray[2,1]", "tray[2,2]", "tray[2,3]", "tray[2,4]"]),
        ("tray[*,4]", ["tray[1,4]", "tray[2,4]", "tray[3,4]"]),
        ("tray[3,1]", ["tray[3,1]"]),
        ("rack", ["rack[1,1]", "rack[1,2]"]),
    ],
)
def test_a_loop_may_go_through_a_row_a_column_a_cell(cells: str, gone_to: list[str]) -> None:
    each = cells.partition("[")[0] + "[each]"
    assert labels({"for_each": cells, "do": [{"approach": each}]}) == [f"approach {cell}" for cell in gone_to]


def test_full_pallet_has_a_part_and_a_target_for_every_cell() -> None:
    full = job(
        {"for_each": "box", "do": [{"pick": "box[each]"}, {"place": "tray[next]"}]},
        pallets={"tray": TRAY, "box": {**BOX, "full": True}},
    )
    assert list(starting_parts(full, 0.4)) == ["box[1,1]", "box[1,2]", "box[1,3]"]
    assert starting_parts(full, 0.4)["box[1,2]"] == pytest.approx((1.1, 0.3, 0.4))
    ends = expand(full, 0.4).parts
    assert ends["box[1,1]"] == (0.3, 1.0, 0.4)
    assert ends["box[1,3]"] == pytest.approx((0.5, 1.0, 0.4))


def test_a_part_is_not_called_as_a_cell_of_a_full_pallet() -> None:
    error = refusal("home", parts={"box[1,2]": [0.5, 1.1]}, pallets={"box": {**BOX, "full": True}})
    assert error.details["key"] == "parts.box[1,2]"


def test_cell_keeps_its_place_when_its_part_is_taken() -> None:
    full = {"tray": TRAY, "box": {**BOX, "full": True}}
    steps = ({"pick": "box[1,1]"}, {"place": "tray[1,1]"}, {"pick": "tray[1,1]"}, {"place": "box[1,1]"})
    assert [task.part for task in tasks(*steps, pallets=full)] == ["box[1,1]"] * 4


def test_a_named_part_is_found_on_its_cell_however_that_was_computed() -> None:
    third = {"corners": [[0.2, 1.0], [0.5, 1.0]], "rows": 1, "columns": 4}
    part = Job.parse({"parts": {"cube": [0.3, 1.0]}, "pallets": {"line": third}, "steps": [{"pick": "line[1,2]"}]})
    (task,) = expand(part, 0.4).tasks
    assert isinstance(task.action, Pick)
    assert task.action.target.x != 0.3
    assert task.part == "cube"


def test_a_taught_pose_is_a_place_and_a_goal() -> None:
    pick, move = tasks({"pick": "shelf"}, {"move": "shelf"})
    assert (pick.action, move.action) == (Pick(Point(0.5, 1.1, 0.62)), MoveJoints(Joints(0.4, 1.6, 1.3)))
    assert move.label == "move shelf"


def test_names_of_the_job_come_before_taught_names() -> None:
    (task,) = tasks({"pick": "shelf"}, places={"shelf": [1.0, 0.5]})
    assert task.action == Pick(Point(1.0, 0.5, 0.4))


def test_corners_may_be_places_and_taught_poses() -> None:
    corners = {"mixed": {"corners": ["here", "shelf"], "rows": 1, "columns": 3}}
    (task,) = tasks({"approach": "mixed[1,2]"}, places={"here": [0.3, 1.1]}, pallets=corners)
    assert isinstance(task.action, Approach)
    assert task.action.target == pytest.approx((0.4, 1.1, 0.51))


def test_taught_poses_are_read_only_for_jobs_that_need_them() -> None:
    def broken() -> TaughtPlaces:
        raise AssertionError("nobody needed it")

    loop = {"for_each": "box", "do": [{"pick": "box[each]"}, {"place": "tray[next]"}]}
    assert len(expand(job(loop, {"move": [0.4, 1.6, 1.3]}), 0.4, broken).tasks) == 7


@pytest.mark.parametrize(
    ("step", "key", "reason"),
    [
        ({"pick": "tray[4,1]"}, "steps.0.pick", r"there is no tray\[4,1\]: it has rows 1 to 3 and columns 1 to 4"),
        ({"pick": "tray[0,1]"}, "steps.0.pick", "rows 1 to 3"),
        ({"pick": "tray[1,*]"}, "steps.0.pick", "one cell of tray"),
        ({"pick": "tray[each]"}, "steps.0.pick", "steps of a loop over tray"),
        ({"approach": "tray[next]"}, "steps.0.approach", "only pick and place"),
        ({"pick": "tray"}, "steps.0.pick", r"tray is a pallet; name a cell: tray\[1,1\]"),
        ({"pick": "rack"}, "steps.0.pick", "rack is a pallet"),
        ({"pick": "slack"}, "steps.0.pick", "cannot meet"),
        ({"for_each": "tray[5,*]", "do": ["home"]}, "steps.0.for_each", r"no tray\[5,\*\]: it has rows 1 to 3"),
        ({"for_each": "tray[next]", "do": ["home"]}, "steps.0.for_each", "goes through tray"),
        ({"for_each": "box", "do": [{"pick": "tray[each]"}]}, "steps.0.do.0.pick", "a loop over tray"),
    ],
)
def test_invalid_cell_is_refused_at_its_key(step: dict[str, Any], key: str, reason: str) -> None:
    error = refusal(step)
    assert error.details["key"] == key
    with pytest.raises(InvalidJob, match=reason):
        raise error


@pytest.mark.parametrize(
    ("step", "known"),
    [
        ({"pick": "shelv"}, r"tray\[row,column\], box\[row,column\], rack\[row,column\], shelf, slack"),
        ({"pick": "crate[1,1]"}, "shelf"),
        ({"move": "rack"}, "Known: shelf, slack"),
        ({"for_each": "shelf", "do": ["home"]}, "Known: tray, box, rack"),
    ],
)
def test_an_unknown_name_lists_the_known_ones(step: dict[str, Any], known: str) -> None:
    with pytest.raises(UnknownName, match=known):
        tasks(step)


def test_corners_that_span_no_grid_are_refused_at_the_pallet() -> None:
    crossed = {"tray": {"corners": [[0.3, 1.0], [0.6, 1.0], [0.6, 1.2], [0.3, 1.2]], "rows": 2, "columns": 2}}
    error = refusal({"pick": "tray[1,1]"}, pallets=crossed)
    assert error.details["key"] == "pallets.tray"
    error = refusal({"pick": "tray[1,1]"}, pallets={"tray": {**TRAY, "corners": ["shelf", "nowhere", "shelf"]}})
    assert error.details["key"] == "pallets.tray.corners.1"


def test_loop_with_too_many_tasks_is_refused() -> None:
    wide = {"tray": {**TRAY, "rows": 30, "columns": 30}}
    loop = {"for_each": "tray", "do": ["home", "home"]}
    assert len(tasks(loop, pallets=wide)) == 1800 <= MOST_TASKS
    assert refusal(loop, pallets=wide, repeat=2).details["key"] == "job"
