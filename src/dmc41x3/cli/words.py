"""The sentences of the command `dmc`, in every language; those of errors stand in `dmc41x3.messages`."""

from __future__ import annotations

_WORDS: dict[str, tuple[str, str]] = {
    "captures": (
        "Listening on {address} for {controller}. Ctrl-C ends the recording.",
        "Escuchando en {address} para {controller}. Ctrl-C termina la grabación.",
    ),
    "replayed": (
        "{commands} commands; {differences} answers differ from the recording.",
        "{commands} comandos; {differences} respuestas difieren de la grabación.",
    ),
    "sent": ("sent", "enviado"),
    "expected": ("expected", "esperado"),
    "received": ("received", "recibido"),
    "known_from": ("known from", "según"),
    "two": ("two sources", "dos fuentes"),
    "one": ("one source", "una fuente"),
    "inferred": ("inferred", "deducido"),
    "conforms": (
        "{right} answers are right, {differ} differ; {left} conversations were left out (--moves "
        "and --bench allow more).",
        "{right} respuestas son correctas, {differ} difieren; {left} conversaciones se omitieron "
        "(--moves y --bench permiten más).",
    ),
}


def word(key: str, language: str, **details: object) -> str:
    """Return the words of `key` in `language`, with their details filled in."""
    english, spanish = _WORDS[key]
    return (spanish if language == "es" else english).format(**details)
