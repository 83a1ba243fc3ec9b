"""Cached plans of primitives: a job runs the plan that it previewed, computed once.

In a worker (`maya_un.workers`) they are built on the planner of the controller layer (`controller.paper`).
"""

from __future__ import annotations

from collections.abc import Generator

from maya_un.config import Config
from maya_un.controller.offline_planner import drawer
from maya_un.errors import PathRefused, TrajectoryRefused, Unreachable
from maya_un.kinematics.workspace import Workspace
from maya_un.robot.plan import ActionDetail, Pose, PrimitivePlan, PrimitivePreview, TravelAction
from maya_un.robot.plan_builder import PlanBuilder, PlanningMachine
from maya_un.robot.primitives import Primitive

_REMEMBERED = 4096


class Plans:
    """Computes plans on `ground`, and caches them by primitive and start."""

    def __init__(self, ground: PlanningMachine) -> None:
        self._ground = ground
        self._plans: dict[tuple[Primitive, Pose], tuple[PrimitivePlan, Workspace]] = {}

    @property
    def config(self) -> Config:
        """The machine's constants."""
        return self._ground.config

    def plan(self, primitive: Primitive, start: Pose) -> PrimitivePlan:
        """Return the plan, cached or new; a cached one of another workspace must be equal in this one.

        Raises what `Robot.preview` raises.
        """
        workspace = self._ground.workspace
        known = self._plans.get((primitive, start))
        if known is not None and (known[1] is workspace or self._holds(known[0])):
            plan = known[0]
        else:
            builder = PlanBuilder(self._ground, start)
            primitive.plan(builder)
            plan = builder.build()
        self.remember(primitive, start, plan)
        return plan

    def remember(self, primitive: Primitive, start: Pose, plan: PrimitivePlan) -> None:
        """Cache a plan of the present workspace."""
        if len(self._plans) >= _REMEMBERED:
            self._plans.clear()
        self._plans[primitive, start] = (plan, self._ground.workspace)

    def preview(self, primitive: Primitive, start: Pose) -> PrimitivePreview:
        """Return the preview of `primitive` from `start`; raises as `plan` does."""
        return self.plan(primitive, start).preview()

    def inspect(self, primitive: Primitive, start: Pose, samples: int = 200) -> tuple[list[ActionDetail], Pose]:
        """Return the details of every action of `primitive` from `start`, and where it ends; raises as `plan` does.

        Every motion has so many `samples`.
        """
        plan = self.plan(primitive, start)
        details: list[ActionDetail] = []
        for action in plan.actions:
            motion = self._ground.inspect(action.path, samples=samples) if isinstance(action, TravelAction) else None
            details.append(ActionDetail(action.phases(), action.duration, motion))
        return details, plan.end

    def _holds(self, plan: PrimitivePlan) -> bool:
        """Whether `plan` is unchanged in this workspace: homing measures strokes, and zones lower speeds."""
        travels = [action for action in plan.actions if isinstance(action, TravelAction)]
        try:
            return all(self._ground.preview(travel.path) == travel.preview for travel in travels)
        except (Unreachable, PathRefused, TrajectoryRefused):
            return False


def on_paper(workspace: Workspace) -> Plans:
    """Return the plans of this worker for a workspace."""
    return drawer().on(workspace, Plans)


def plan(workspace: Workspace, primitive: Primitive, start: Pose) -> Generator[None, None, PrimitivePlan]:
    """Return the plan of a primitive in a worker; raises as `Plans.plan` does."""
    yield
    return on_paper(workspace).plan(primitive, start)
