"""Texts of `maya queue`, `maya job` and `maya history`, in every language."""

from __future__ import annotations

_WORDS: dict[str, tuple[str, str]] = {
    "queue_running": ("The queue is running.", "La cola está en marcha."),
    "queue_pausing": (
        "The queue pauses after the current step ({reason}).",
        "La cola se pausa tras el paso en curso ({reason}).",
    ),
    "queue_paused": (
        "The queue is paused since {since} ({reason}). `maya queue resume` continues it.",
        "La cola está en pausa desde las {since} ({reason}). `maya queue resume` la continúa.",
    ),
    "queue_asks": (
        "The queue is paused since {since} ({reason}).",
        "La cola está en pausa desde las {since} ({reason}).",
    ),
    "driver": ("{holder} drives: jobs of others wait.", "{holder} conduce: los trabajos de otros esperan."),
    "you_drive": ("You drive: jobs of others wait.", "Usted conduce: los trabajos de otros esperan."),
    "nothing_waits": ("No job is waiting.", "Ningún trabajo espera."),
    "under_way": ("under way: {phase}, {percent:.0f} %", "en curso: {phase}, {percent:.0f} %"),
    "counted": ("{count} {state}", "{count} {state}"),
    "more_wait": ("{count} more are waiting.", "{count} más esperan."),
    "finish_at": ("All jobs will have ended at {clock}.", "Todos los trabajos habrán terminado a las {clock}."),
    "finish_at_released": (
        "All jobs but the held ones will have ended at {clock}.",
        "Todos los trabajos menos los retenidos habrán terminado a las {clock}.",
    ),
    "estimated": ("about {clock} (with an estimated homing)", "{clock} aproximadamente (con un homing estimado)"),
    "number": ("job", "trabajo"),
    "name": ("name", "nombre"),
    "state": ("state", "estado"),
    "steps": ("steps", "pasos"),
    "ends_in": ("ends in", "termina en"),
    "at": ("at", "a las"),
    "owner": ("owner", "dueño"),
    "priority": ("prio", "prio"),
    "notes": ("notes", "notas"),
    "predicted": ("predicted", "previsto"),
    "took": ("took", "duró"),
    "submitted": ("submitted", "enviado"),
    "source": ("from", "desde"),
    "proposal": ("{state}, proposal", "{state}, propuesta"),
    "after_jobs": ("after {jobs}", "después de {jobs}"),
    "state_queued": ("queued", "en cola"),
    "state_held": ("held", "retenido"),
    "state_running": ("running", "en marcha"),
    "state_paused": ("paused", "en pausa"),
    "state_interrupted": ("interrupted", "interrumpido"),
    "state_done": ("done", "hecho"),
    "state_failed": ("failed", "fallido"),
    "state_cancelled": ("cancelled", "cancelado"),
    "state_skipped": ("skipped", "omitido"),
    "interrupted": (
        "Job {job}, {name}, was interrupted in step {index}, {step} ({phase}). This was detected at {since}.",
        "El trabajo {job}, {name}, se interrumpió en el paso {index}, {step} ({phase}). Se detectó a las {since}.",
    ),
    "interrupted_between": (
        "Job {job}, {name}, was interrupted between two steps. This was detected at {since}.",
        "El trabajo {job}, {name}, se interrumpió entre dos pasos. Se detectó a las {since}.",
    ),
    "begun": ("begun", "comenzado"),
    "gripper_open": ("The gripper is open.", "La pinza está abierta."),
    "gripper_unknown": (
        "The gripper is closed. Only a person can see whether it holds a part.",
        "La pinza está cerrada. Solo una persona puede ver si sujeta una pieza.",
    ),
    "gripper_holds": ("The gripper holds a part.", "La pinza sujeta una pieza."),
    "robot_at": ("The robot is at {place}.", "El robot está en {place}."),
    "robot_unknown": (
        "The robot is not homed: run `maya home` first.",
        "El robot no ha hecho el homing: ejecute primero `maya home`.",
    ),
    "choose": (
        "Nothing moves until a person chooses: maya queue recover CHOICE",
        "Nada se mueve hasta que una persona elija: maya queue recover ELECCIÓN",
    ),
    "choice_resume": (
        "continue safely: finished work is not repeated",
        "continuar de modo seguro: el trabajo hecho no se repite",
    ),
    "choice_redo": ("do the interrupted step again, then the rest", "repetir el paso interrumpido, luego el resto"),
    "choice_skip": ("skip the interrupted step, do the rest", "omitir el paso interrumpido, hacer el resto"),
    "choice_abort": ("end the job as cancelled", "terminar el trabajo como cancelado"),
    "with_holding": ("{meaning} (with --holding yes|no)", "{meaning} (con --holding yes|no)"),
    "ask_choice": ("What is to be done with it ({choices})? ", "¿Qué se hace con él ({choices})? "),
    "ask_holding": ("Does the gripper hold a part (yes, no)? ", "¿La pinza sujeta una pieza (sí, no)? "),
    "ask_again": ("One of: {choices}", "Uno de: {choices}"),
    "nothing_interrupted": ("Nothing was interrupted.", "Nada se interrumpió."),
    "cleared": ("Jobs cancelled: {count}.", "Trabajos cancelados: {count}."),
    "accepted": ("Job {id}, {name}: {steps} steps.", "Trabajo {id}, {name}: {steps} pasos."),
    "became": ("Job {id}, {name}: {state}.", "Trabajo {id}, {name}: {state}."),
    "placed": (
        "Job {id}, {name}: number {position} of the waiting jobs.",
        "Trabajo {id}, {name}: número {position} en espera.",
    ),
    "again": (
        "Job {id}, {name}: {state}; it is job {old} again.",
        "Trabajo {id}, {name}: {state}; es el trabajo {old} otra vez.",
    ),
    "asked_by": (
        "asked for by {owner} ({source}) at {submitted}, began {began}, ended {ended}",
        "pedido por {owner} ({source}) a las {submitted}, comenzó {began}, terminó {ended}",
    ),
    "approved": ("You approved this job of {owner}:", "Usted aprobó este trabajo de {owner}:"),
    "to_approve": (
        "An operator approves this version with: maya job release {job} --version {version}",
        "Un operador aprueba esta versión con: maya job release {job} --version {version}",
    ),
    "no_history": ("Nothing has been done yet.", "Todavía no se ha hecho nada."),
    "backed_up": (
        "{path}: {jobs} jobs, {unfinished} of them unfinished, {size} kB.",
        "{path}: {jobs} trabajos, {unfinished} sin terminar, {size} kB.",
    ),
    "restored": (
        "{path}: {jobs} jobs, {unfinished} of them unfinished. The former file is kept as {aside}",
        "{path}: {jobs} trabajos, {unfinished} sin terminar. El archivo anterior se conserva como {aside}",
    ),
    "kept_nothing": ("nothing", "nada"),
    "exported": ("{path}: {jobs} jobs.", "{path}: {jobs} trabajos."),
    "unchanged": ("Nothing was changed.", "No se cambió nada."),
}


def word(key: str, language: str, **details: object) -> str:
    """Return the words of `key` in `language`, with their details filled in."""
    english, spanish = _WORDS[key]
    return (spanish if language == "es" else english).format(**details)


def known(key: str) -> bool:
    """Tell whether there are words for `key`."""
    return key in _WORDS
