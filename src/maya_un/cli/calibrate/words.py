"""Texts of `maya calibrate`, in every language."""

from __future__ import annotations

_WORDS: dict[str, tuple[str, str]] = {
    "constant": ("constant", "constante"),
    "now": ("now", "ahora"),
    "fitted": ("fitted", "ajustado"),
    "held": ("held", "fijo"),
    "points": (
        "{used} of {measured} points; off by {before:.2f} mm (rms) now, by {after:.2f} mm after the fit.",
        "{used} de {measured} puntos; desvío de {before:.2f} mm (rms) ahora, de {after:.2f} mm tras el ajuste.",
    ),
    "outliers": (
        "Left out as outliers, by row: {rows}.",
        "Descartados como atípicos, por fila: {rows}.",
    ),
    "outlier": ("{row} ({off:.1f} mm)", "{row} ({off:.1f} mm)"),
    "not_applied": (
        "Nothing was changed; --apply writes these values into {path}.",
        "No se cambió nada; --apply escribe estos valores en {path}.",
    ),
    "applied": (
        "Calibration {number} is in {path}. Restart `maya up` and home: zeros take effect with the next homing.",
        "La calibración {number} está en {path}. Reinicie `maya up` y haga el homing: los ceros valen desde él.",
    ),
    "reverted": (
        "Calibration {reverts} is reverted in {path}. Restart `maya up` and home.",
        "La calibración {reverts} se deshizo en {path}. Reinicie `maya up` y haga el homing.",
    ),
    "nothing_changes": (
        "The configuration has these values already; nothing was written.",
        "La configuración ya tiene estos valores; no se escribió nada.",
    ),
    "no_history": ("No calibration was ever applied to {path}.", "Nunca se aplicó una calibración a {path}."),
    "date": ("date", "fecha"),
    "step": ("step", "paso"),
    "author": ("by", "por"),
    "file": ("points", "puntos"),
    "before": ("rms before [mm]", "rms antes [mm]"),
    "after": ("after [mm]", "después [mm]"),
    "step_applied": ("applied", "aplicada"),
    "step_in_force": ("applied, in force", "aplicada, vigente"),
    "step_reverted": ("reverted {reverts}", "deshizo {reverts}"),
    "plotted": ("Written: {path}", "Escrito: {path}"),
    "going": (
        "Point {number} of {total}: moving to {joints}.",
        "Punto {number} de {total}: yendo a {joints}.",
    ),
    "not_there": ("Left out: {reason}", "Omitido: {reason}"),
    "ask": (
        "Measured x y z (in m, or like 812.5mm; s skips, q quits):",
        "x y z medidos (en m, o como 812.5mm; s omite, q termina):",
    ),
    "again": ("{reason} Enter it again.", "{reason} Repítalo."),
    "noted": (
        "Saved; {off:.1f} mm from the configured position.",
        "Guardado; a {off:.1f} mm de la posición configurada.",
    ),
    "collected": (
        "{count} points in {path}. Next: maya calibrate {path}",
        "{count} puntos en {path}. Ahora: maya calibrate {path}",
    ),
}


def word(key: str, language: str, **details: object) -> str:
    """Return the words of `key` in `language`, with their details filled in."""
    english, spanish = _WORDS[key]
    return (spanish if language == "es" else english).format(**details)
