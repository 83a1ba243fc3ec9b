"""`maya queue recover`: the decision of a person about the interrupted job."""

from __future__ import annotations

import sys
import unicodedata
from collections.abc import Mapping, Sequence
from typing import Any

from dmc41x3.i18n import phrase, translate
from maya_un.cli import output
from maya_un.cli.client import ServiceClient
from maya_un.cli.queueing import text
from maya_un.cli.settings import OutputSettings
from maya_un.cli.units import units_of
from maya_un.client import requests
from maya_un.errors import InvalidCommandLine
from maya_un.schema.choices import RecoveryChoice

_COMMAND = "maya queue recover"


def recover(choice: RecoveryChoice | None, holding: bool | None, settings: OutputSettings, *, pause: bool) -> int:
    """Decide about the interrupted job; on a terminal, prompt for missing answers.

    With `pause` the queue stays paused. Raises `InvalidCommandLine` if a choice is missing without a terminal, and
    `AnswerNeeded`.
    """
    client = ServiceClient.find()
    offer = client.ask(requests.queue())["recovery"]
    if offer is None:
        return output.answer({"recovery": None}, translate("Nothing was interrupted.", settings.language), settings)
    asks = sys.stdin.isatty() and not settings.json
    if choice is None:
        if not asks:
            raise InvalidCommandLine(reason=phrase("{name} is missing", name="CHOICE"), command=_COMMAND)
        output.say(text.recovery(offer, settings.language, units_of(settings)))
        names = [one["name"] for one in offer["choices"]]
        question = translate("Choose what to do with the job ({choices}): ", settings.language)
        choice = RecoveryChoice(typed(question, names, settings.language))
    if holding is None and asks and _needs_answer(offer, choice):
        yes, no = translate("yes", settings.language), translate("no", settings.language)
        question = translate("Does the gripper hold a part (yes, no)? ", settings.language)
        holding = typed(question, (yes, no), settings.language) == yes
    view = client.ask(requests.choose_recovery(choice.value, holding=holding, resume_queue=not pause, job=offer["job"]))
    said = text.mode(view, settings.language)
    if view["recovery"] is not None:  # another job is interrupted
        said = f"{said}\n\n{text.recovery(view['recovery'], settings.language, units_of(settings))}"
    return output.answer(view, said, settings)


def _needs_answer(offer: Mapping[str, Any], choice: str) -> bool:
    return any(one["name"] == choice and one["needs_answer"] for one in offer["choices"])


def typed(question: str, answers: Sequence[str], language: str) -> str:
    """Return one of the answers, typed in full or abbreviated; raises `InvalidCommandLine` at the end of the input."""
    choices = ", ".join(answers)
    while True:
        try:
            said = _plain(input(question.format(choices=choices)).strip().lower())
        except EOFError:
            raise InvalidCommandLine(reason="no choice was given", command=_COMMAND) from None
        meant = [answer for answer in answers if said and _plain(answer).startswith(said)]
        same = [answer for answer in meant if _plain(answer) == said]
        if same or len(meant) == 1:
            return (same or meant)[0]
        output.say(translate("One of: {choices}", language, choices=choices))


def _plain(said: str) -> str:
    """Return an answer without accents, which some keyboards lack."""
    return "".join(letter for letter in unicodedata.normalize("NFD", said) if not unicodedata.combining(letter))
