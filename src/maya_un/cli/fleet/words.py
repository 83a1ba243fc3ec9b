"""Texts of `maya fleet`, in every language."""

from __future__ import annotations

_WORDS: dict[str, tuple[str, str]] = {
    "no_robots": (
        "The broker {where} knows no robot. Start one with `maya up --coms`.",
        "El broker {where} no conoce ningún robot. Arranque uno con `maya up --coms`.",
    ),
    "presence": ("{robot}  {state}", "{robot}  {state}"),
    "accepted": ("{robot}  accepted   {id}", "{robot}  aceptado   {id}"),
    "executing": ("{robot}  executing  {id}", "{robot}  en curso   {id}"),
    "succeeded": ("{robot}  done       {id}", "{robot}  hecho      {id}"),
    "failed": ("{robot}  failed     {id}: {error} ({code})", "{robot}  fallido    {id}: {error} ({code})"),
    "done": ("Done by {robot}.", "Hecho por {robot}."),
    "waits_for": (
        "{robot} is {state}. Its steps wait for it until their deadline.",
        "{robot} está {state}. Sus pasos lo esperan hasta su plazo.",
    ),
    "plan": ("{name}: {steps} steps for {robots}.", "{name}: {steps} pasos para {robots}."),
    "checked": ("{path} is a valid process.", "{path} es un proceso válido."),
    "resumed": (
        "{over} of {steps} steps have ended; the process continues.",
        "{over} de {steps} pasos han terminado; el proceso continúa.",
    ),
    "finished": (
        "All {steps} steps have ended: {done} done, {skipped} skipped.",
        "Han terminado los {steps} pasos: {done} hechos, {skipped} omitidos.",
    ),
    "finished_before": (
        "All {steps} steps had ended before, so nothing was sent. --again starts over.",
        "Los {steps} pasos ya habían terminado y no se envió nada. --again empieza de nuevo.",
    ),
    "kept": (
        "Interrupted. Running steps continue; the same command continues with the rest.",
        "Interrumpido. Los pasos en curso continúan; la misma orden sigue con el resto.",
    ),
    "ask": (
        "What is to be done with step {step} (retry, skip, abort)? ",
        "¿Qué se hace con el paso {step} (retry, skip, abort)? ",
    ),
    "ask_again": ("One of: retry, skip, abort", "Uno de: retry, skip, abort"),
}


def word(key: str, language: str, **details: object) -> str:
    """Return the words of `key` in `language`, with their details filled in."""
    english, spanish = _WORDS[key]
    return (spanish if language == "es" else english).format(**details)
