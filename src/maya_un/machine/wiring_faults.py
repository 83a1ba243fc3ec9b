"""Kinds of mistakes that people make when they wire a machine, and one of them drawn by a seed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any, NamedTuple

from maya_un.machine.truth import MOTOR_LIMIT, Random, TrueConstants
from maya_un.machine.wiring import AXES, SIDES

OUTPUTS, NO_OUTPUT = 8, 0
FACTORS = (0.1, 0.25, 0.5, 2.0, 4.0, 10.0)

STIFF = 6.0
"""Friction of a line whose torque limit is too low [loads]: homing allows less, and a motion of the greatest load more.
"""


class WiringFault(NamedTuple):
    """A mistake of one `kind` at a `part` of the machine ("b", "b c", "c forward" or ""), and the machine with it."""

    kind: str
    part: str
    truth: TrueConstants


def _pick(rng: Random, choices: Any) -> Any:
    return choices[min(int(rng.random() * len(choices)), len(choices) - 1)]


def _of_axis(field: str) -> Callable[[Random, TrueConstants], tuple[str, TrueConstants]]:
    def made(rng: Random, truth: TrueConstants) -> tuple[str, TrueConstants]:
        name = _pick(rng, AXES)
        return name, _wired(truth, **{field: (name,)})

    return made


def _of_pair(field: str) -> Callable[[Random, TrueConstants], tuple[str, TrueConstants]]:
    def made(rng: Random, truth: TrueConstants) -> tuple[str, TrueConstants]:
        one, other = pair = _pick(rng, (("a", "b"), ("a", "c"), ("b", "c")))
        return f"{one} {other}", _wired(truth, **{field: pair})

    return made


def _of_switch(field: str) -> Callable[[Random, TrueConstants], tuple[str, TrueConstants]]:
    def made(rng: Random, truth: TrueConstants) -> tuple[str, TrueConstants]:
        switch = f"{_pick(rng, AXES)} {_pick(rng, SIDES)}"
        return switch, _wired(truth, **{field: (switch,)})

    return made


def _wired(truth: TrueConstants, **changes: Any) -> TrueConstants:
    return replace(truth, wiring=replace(truth.wiring, **changes))


def _both_reversed(rng: Random, truth: TrueConstants) -> tuple[str, TrueConstants]:
    name = _pick(rng, AXES)
    return name, _wired(truth, encoder_reversed=(name,), motor_reversed=(name,))


def _factor(rng: Random, truth: TrueConstants) -> tuple[str, TrueConstants]:
    name, factor = _pick(rng, AXES), _pick(rng, FACTORS)
    a, b, c = (factor if axis == name else 1.0 for axis in AXES)
    return name, _wired(truth, encoder_factor=(a, b, c))


def _axes_exchanged(rng: Random, truth: TrueConstants) -> tuple[str, TrueConstants]:
    one, other = _pick(rng, ((0, 1), (0, 2), (1, 2)))
    letters = list(truth.letters)
    letters[one], letters[other] = letters[other], letters[one]
    return f"{AXES[one]} {AXES[other]}", replace(truth, letters="".join(letters))


def _torque_low(rng: Random, truth: TrueConstants) -> tuple[str, TrueConstants]:
    axis = _pick(rng, (1, 2))
    stiff = min(STIFF * truth.torque_per_load, 0.8 * MOTOR_LIMIT)
    a, b, c = (stiff if one == axis else friction for one, friction in enumerate(truth.friction))
    return AXES[axis], replace(truth, friction=(a, b, c))


def _levels(rng: Random, truth: TrueConstants) -> tuple[str, TrueConstants]:
    del rng
    return "", truth.with_wiring(not truth.active_high[0][0])


def _gripper_output(rng: Random, truth: TrueConstants) -> tuple[str, TrueConstants]:
    others = [bit for bit in range(1, OUTPUTS + 1) if bit != truth.gripper_output]
    return "", replace(truth, gripper_output=_pick(rng, others))


def _gripper_dead(rng: Random, truth: TrueConstants) -> tuple[str, TrueConstants]:
    del rng
    return "", replace(truth, gripper_output=NO_OUTPUT)


def _gripper_inverted(rng: Random, truth: TrueConstants) -> tuple[str, TrueConstants]:
    del rng
    return "", replace(truth, gripper_closes_on=not truth.gripper_closes_on)


def _stop(how: str) -> Callable[[Random, TrueConstants], tuple[str, TrueConstants]]:
    return lambda _, truth: ("", _wired(truth, stop=how))


KINDS: dict[str, Callable[[Random, TrueConstants], tuple[str, TrueConstants]]] = {
    "encoder_reversed": _of_axis("encoder_reversed"),
    "motor_reversed": _of_axis("motor_reversed"),
    "both_reversed": _both_reversed,
    "encoder_dead": _of_axis("encoder_dead"),
    "encoder_factor": _factor,
    "encoders_exchanged": _of_pair("encoders_exchanged"),
    "motors_exchanged": _of_pair("motors_exchanged"),
    "axes_exchanged": _axes_exchanged,
    "amplifier_off": _of_axis("amplifier_off"),
    "brake_closed": _of_axis("brake_closed"),
    "torque_low": _torque_low,
    "switch_levels": _levels,
    "switch_inverted": _of_switch("switch_inverted"),
    "switch_open": _of_switch("switch_open"),
    "switches_exchanged": _of_axis("switches_exchanged"),
    "gripper_output": _gripper_output,
    "gripper_dead": _gripper_dead,
    "gripper_inverted": _gripper_inverted,
    "stop_open": _stop("open"),
    "stop_inverted": _stop("inverted"),
}
"""Every kind of mistake, by its name."""


def drawn(rng: Random, plan: TrueConstants, kind: str | None = None) -> WiringFault:
    """Return a machine with one mistake, of a given kind or a drawn one."""
    name: str = kind or _pick(rng, tuple(KINDS))
    part, truth = KINDS[name](rng, plan)
    return WiringFault(name, part, truth)
