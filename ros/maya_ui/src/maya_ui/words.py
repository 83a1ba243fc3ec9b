"""Every word that the dashboard shows, in English and Spanish, by key."""

from __future__ import annotations

import json
import re
from functools import lru_cache
from string import Formatter
from typing import Any

from maya_ui.resources import resource

LANGUAGES: dict[str, str] = {"en": "English", "es": "Español"}
"""The languages, each by its name in that language."""

WORDS: dict[str, tuple[str, str]] = {
    # Texts of widgets, by the name of the widget.
    "title": ("Maya", "Maya"),
    "language": ("Language", "Idioma"),
    "stop": ("STOP", "PARAR"),
    "stop_hint": (
        "Stop all motion on its path, homing included. Keys: Esc or F12, from anywhere in this window.",
        "Detener todo movimiento sobre su trayectoria, incluida la búsqueda de origen. Teclas: Esc o F12.",
    ),
    "stop_keys": ("Esc · F12", "Esc · F12"),
    "recover": ("Recover", "Recuperar"),
    "resume_queue": ("Resume queue", "Reanudar cola"),
    "resume_queue_hint": (
        "Continue the paused queue. The robot may move at once.",
        "Reanudar la cola en pausa. El robot puede moverse de inmediato.",
    ),
    "recover_queue": ("Decide…", "Decidir…"),
    "recover_queue_hint": (
        "Decide about the interrupted job. Unless you end it, the queue continues and the robot may move.",
        "Decidir sobre el trabajo interrumpido. Si no lo termina, la cola continúa y el robot puede moverse.",
    ),
    "choice_resume": ("Resume", "Reanudar"),
    "choice_redo": ("Repeat the step", "Repetir el paso"),
    "choice_skip": ("Skip the step", "Omitir el paso"),
    "choice_abort": ("End the job", "Terminar el trabajo"),
    "holding_yes": ("the gripper holds a part", "la pinza tiene una pieza"),
    "holding_no": ("the gripper is empty", "la pinza está vacía"),
    "between_steps": ("between two steps", "entre dos pasos"),
    "queue_paused": (
        "The queue is paused ({reason}). Waiting jobs do not begin: press Resume queue.",
        "La cola está en pausa ({reason}). Los trabajos en espera no empiezan: pulse Reanudar cola.",
    ),
    "queue_interrupted": (
        "Job {job} was interrupted ({step}) because the robot's program ended. Look at the robot, then press Decide.",
        "El trabajo {job} se interrumpió ({step}) porque el programa del robot terminó. Mire el robot y pulse Decidir.",
    ),
    "queue_waits": (
        "The queue is paused: your tasks wait in it.",
        "La cola está en pausa: sus tareas esperan en ella.",
    ),
    "queue_runs": ("The queue is not paused.", "La cola no está en pausa."),
    "decide_first": (
        "An interrupted job waits: press Decide first.",
        "Un trabajo interrumpido espera: pulse primero Decidir.",
    ),
    "no_interrupted_job": ("No job was interrupted.", "No hay ningún trabajo interrumpido."),
    "queue_reason_asked": ("a pause command", "una orden de pausa"),
    "queue_reason_step": ("step mode", "modo paso a paso"),
    "queue_reason_stop": ("a stop command", "una orden de parada"),
    "queue_reason_fault": ("a fault", "una falla"),
    "queue_reason_restart": ("the robot's program was started again", "el programa del robot se reinició"),
    "queue_reason_driver": ("the driver no longer responds", "el conductor ya no responde"),
    "queue_reason_storage": ("the disk cannot be written", "no se puede escribir en el disco"),
    "queue_reason_failure": ("a job failed", "un trabajo falló"),
    "recover_hint": (
        "Clear the fault once its cause is gone. Nothing moves.",
        "Borrar la falla cuando ya no exista la causa. Nada se mueve.",
    ),
    "pause": ("Pause", "Pausa"),
    "pause_hint": ("Brake on the path and hold.", "Frenar sobre la trayectoria y esperar."),
    "resume": ("Resume", "Reanudar"),
    "resume_hint": ("Continue on the path.", "Continuar donde se detuvo."),
    "speed": ("Speed", "Velocidad"),
    "speed_hint": ("Scales the speed of all motion.", "Escala la velocidad de todo movimiento."),
    "where": ("Gripper", "Pinza"),
    "where_hint": ("Position of the gripper point", "Posición del punto de la pinza"),
    "teleop": ("Move while held", "Mover mientras se mantiene"),
    "reach": ("At most", "Como máximo"),
    "reach_hint": (
        "How far the robot goes at most before it looks again whether the button is still held.",
        "Cuánto avanza como máximo antes de comprobar si el botón sigue presionado.",
    ),
    "keys": ("Move by keys", "Mover con teclas"),
    "keys_hint": (
        "While this is on and has the focus: arrows move along x and y, Page Up and Down along z, "
        "A and D turn the boom, W and S go out and in. Space stops.",
        "Activo y con el foco: flechas para x e y, Re Pág y Av Pág para z, A y D giran el brazo, W y S salen y entran. "
        "Espacio detiene.",
    ),
    "keys_live": (
        "Keys move the robot:  ← ↑ ↓ →   PgUp PgDn   A D  W S.  Space stops.",
        "Las teclas mueven el robot:  ← ↑ ↓ →   RePág AvPág   A D  W S.  Espacio detiene.",
    ),
    "keys_off": (
        "Hold a button; or turn on the keys and hold one.",
        "Mantenga un botón; o active las teclas y mantenga una.",
    ),
    "jog_x_plus": ("x +", "x +"),
    "jog_x_minus": ("x −", "x −"),
    "jog_y_plus": ("y +", "y +"),
    "jog_y_minus": ("y −", "y −"),
    "jog_z_plus": ("▲ up", "▲ subir"),
    "jog_z_minus": ("▼ down", "▼ bajar"),
    "jog_a_plus": ("turn ↻", "girar ↻"),
    "jog_a_minus": ("turn ↺", "girar ↺"),
    "jog_r_plus": ("out", "salir"),
    "jog_r_minus": ("in", "entrar"),
    "primitives": ("Tasks", "Tareas"),
    "home": ("Home", "Buscar origen"),
    "home_hint": (
        "Find the switches; then positions are known.",
        "Buscar los interruptores; así se conoce la posición.",
    ),
    "open_gripper": ("Open gripper", "Abrir pinza"),
    "open_gripper_hint": ("Open the gripper now.", "Abrir la pinza ahora."),
    "close_gripper": ("Close gripper", "Cerrar pinza"),
    "close_gripper_hint": ("Close the gripper now.", "Cerrar la pinza ahora."),
    "command": ("Task", "Tarea"),
    "target": ("Target", "Destino"),
    "target_hint": (
        "Millimetres; or with a unit: 0.41 m, 41 cm.",
        "Milímetros; o con unidad: 0,41 m, 41 cm.",
    ),
    "here": ("Take position", "Usar posición"),
    "here_hint": ("Fill in the gripper's position.", "Copiar la posición actual de la pinza."),
    "now": ("Do it now", "Hacer ahora"),
    "now_hint": (
        "Do it at once; refused while anything else is under way.",
        "Hacerla ya; se rechaza si hay otra en curso.",
    ),
    "send": ("Queue it", "Encolar"),
    "send_hint": (
        "Append it to the robot's queue; it starts when its turn comes.",
        "Añadirla a la cola del robot; empieza cuando le toque.",
    ),
    "add": ("Add to list", "Añadir a la lista"),
    "add_hint": (
        "Put it into the list on the right; nothing moves.",
        "Ponerla en la lista de la derecha; nada se mueve.",
    ),
    "queue": ("List", "Lista"),
    "up": ("Up", "Subir"),
    "up_hint": ("Do this task earlier.", "Hacer esta tarea antes."),
    "down": ("Down", "Bajar"),
    "down_hint": ("Do this task later.", "Hacer esta tarea después."),
    "remove": ("Remove", "Quitar"),
    "remove_hint": ("Take this task from the list.", "Quitar esta tarea de la lista."),
    "clear": ("Clear", "Vaciar"),
    "clear_hint": ("Empty the list.", "Vaciar la lista."),
    "load": ("Load…", "Abrir…"),
    "load_hint": ("Read a job file.", "Leer un archivo de trabajo."),
    "save": ("Save…", "Guardar…"),
    "save_hint": ("Keep the list as a job file of `maya run`.", "Guardar la lista como archivo de `maya run`."),
    "start": ("Start list", "Iniciar lista"),
    "start_hint": (
        "Queue the whole list as one job. It begins after the jobs before it.",
        "Poner toda la lista en la cola como un trabajo. Empieza después de los trabajos anteriores.",
    ),
    "stop_queue": ("Stop queue", "Detener cola"),
    "stop_queue_hint": (
        "Stop all motion and cancel all jobs in the robot's queue, running and waiting.",
        "Detener todo movimiento y cancelar todos los trabajos de la cola del robot, en curso y en espera.",
    ),
    "list_empty": ("The list is empty.", "La lista está vacía."),
    "nothing_chosen": ("Choose a task in the list first.", "Elija primero una tarea de la lista."),
    "events": ("Events", "Eventos"),
    "time": ("Time", "Hora"),
    "event": ("Event", "Evento"),
    "detail": ("Detail", "Detalle"),
    "files": ("Jobs (*.yaml *.yml *.json)", "Trabajos (*.yaml *.yml *.json)"),
    # State of the robot.
    "mode_disconnected": ("Disconnected", "Desconectado"),
    "mode_not_homed": ("Not homed", "Sin origen"),
    "mode_homing": ("Homing", "Buscando origen"),
    "mode_idle": ("Ready", "Listo"),
    "mode_queue_paused": ("Ready, queue paused", "Listo, cola en pausa"),
    "mode_moving": ("Moving", "En movimiento"),
    "mode_paused": ("Paused", "En pausa"),
    "mode_stopping": ("Stopping", "Deteniéndose"),
    "mode_fault": ("Fault", "Falla"),
    "homed": ("homed", "con origen"),
    "not_homed": ("not homed", "sin origen"),
    "moves": ("moving", "en movimiento"),
    "rests": ("at rest", "en reposo"),
    "gripper_open": ("gripper open", "pinza abierta"),
    "gripper_closed": ("gripper closed", "pinza cerrada"),
    "gripper_unknown": ("gripper unknown", "pinza desconocida"),
    "joints": ("boom {a:.2f}°    lines {b:.1f} / {c:.1f} mm", "brazo {a:.2f}°    líneas {b:.1f} / {c:.1f} mm"),
    "unknown_position": ("Not known before homing.", "Se desconoce antes de buscar el origen."),
    # Reasons why something cannot be done now.
    "no_master": ("No ROS master answers.", "No responde ningún maestro de ROS."),
    "master_gone": (
        "The ROS master is gone. Existing connections keep working; new ones need a restart of "
        "the master and the robot.",
        "El maestro de ROS ya no está. Las conexiones existentes siguen; las nuevas necesitan "
        "reiniciar el maestro y el robot.",
    ),
    "no_controller": (
        "No robot: no node publishes /maya_event. Start controller.launch.",
        "Sin robot: ningún nodo publica /maya_event. Inicie controller.launch.",
    ),
    "silent": ("The robot's node runs but sends nothing.", "El nodo del robot funciona, pero no envía nada."),
    "no_machine": (
        "The robot's node runs but has no connection to the machine.",
        "El nodo del robot funciona, pero no tiene conexión con la máquina.",
    ),
    "no_robot_layer": (
        "Tasks need robot.launch; it does not run.",
        "Las tareas necesitan robot.launch; no está en marcha.",
    ),
    "no_process_layer": (
        "The queue needs process.launch; it does not run.",
        "La cola necesita process.launch; no está en marcha.",
    ),
    "recover_first": ("There is a fault: press Recover first.", "Hay una falla: pulse primero Recuperar."),
    "resume_first": ("It is paused: press Resume, or Stop.", "Está en pausa: pulse Reanudar, o Parar."),
    "home_first": ("Not homed: press Home first.", "Sin origen: pulse primero Buscar origen."),
    "busy": ("Something is running: wait, or press Stop.", "Hay algo en curso: espere, o pulse Parar."),
    "gripper_is_closed": ("The gripper is closed: open it to pick.", "La pinza está cerrada: ábrala para tomar."),
    "gripper_is_open": ("The gripper is open: there is nothing to place.", "La pinza está abierta: no hay qué dejar."),
    "no_fault": ("There is no fault.", "No hay ninguna falla."),
    "nothing_moves": ("Nothing moves.", "Nada se mueve."),
    "nothing_paused": ("Nothing is paused.", "Nada está en pausa."),
    "no_position": ("The position is not known.", "Se desconoce la posición."),
    # Errors of typed lengths.
    "length_missing": ("{name}: a number is missing.", "{name}: falta un número."),
    "length_unreadable": (
        "{name}: write a number, in mm or with its unit (0.41 m).",
        "{name}: escriba un número, en mm o con su unidad (0,41 m).",
    ),
    "length_too_long": ("{name}: more than 5 m; enter mm.", "{name}: más de 5 m; escriba mm."),
    # Job files.
    "job_unreadable": (
        "Reading {file} failed: {reason}. Correct the file, or give another one.",
        "No se pudo leer {file}: {reason}. Corrija el archivo o indique otro.",
    ),
    "job_unwritable": (
        "Writing {file} failed: {reason}. Give another path, or correct its permissions.",
        "No se pudo escribir {file}: {reason}. Indique otra ruta o corrija sus permisos.",
    ),
    "job_without_steps": ("{file} has no steps.", "{file} no tiene pasos."),
    "job_too_long": ("That would be more than {most} tasks.", "Serían más de {most} tareas."),
    "job_step_unknown": (
        "Step {number} of {file}: ROS has no message for {step}; use `maya run`.",
        "Paso {number} de {file}: ROS no tiene mensaje para {step}; use `maya run`.",
    ),
    "job_place_unknown": (
        "Step {number} of {file}: the place {place} is not in the file.",
        "Paso {number} de {file}: el lugar {place} no está en el archivo.",
    ),
    "job_place_unreadable": (
        "Step {number} of {file}: {place} is no place [x, y, z] in metres.",
        "Paso {number} de {file}: {place} no es un lugar [x, y, z] en metros.",
    ),
    "job_height_unknown": (
        "Step {number} of {file} has no z, and the grasp height of the robot is not known.",
        "El paso {number} de {file} no tiene z, y la altura de agarre del robot no se conoce.",
    ),
    "loaded": ("{count} tasks read from {file}.", "{count} tareas leídas de {file}."),
    "saved": ("{count} tasks written to {file}.", "{count} tareas escritas en {file}."),
    # Tasks.
    "task_home": ("Home", "Buscar origen"),
    "task_pick": ("Pick", "Tomar"),
    "task_place": ("Place", "Dejar"),
    "task_approach": ("Approach", "Acercarse"),
    "task_open": ("Open gripper", "Abrir pinza"),
    "task_close": ("Close gripper", "Cerrar pinza"),
    # Commands, and how they ended.
    "command_home": ("Home", "Buscar origen"),
    "command_task": ("Task", "Tarea"),
    "command_gripper": ("Gripper", "Pinza"),
    "command_jog": ("Move by hand", "Movimiento manual"),
    "command_stop": ("Stop", "Parar"),
    "command_recover": ("Recover", "Recuperar"),
    "command_pause": ("Pause", "Pausa"),
    "command_resume": ("Resume", "Reanudar"),
    "command_speed": ("Speed", "Velocidad"),
    "command_send": ("Queue", "Cola"),
    "command_start_queue": ("List", "Lista"),
    "command_resume_queue": ("Resume queue", "Reanudar cola"),
    "command_recover_queue": ("Interrupted job", "Trabajo interrumpido"),
    "command_stop_queue": ("Stop queue", "Detener cola"),
    "done": ("{what}: done.", "{what}: listo."),
    "under_way": ("{what}: {phase}", "{what}: {phase}"),
    "asked": ("{what}: requested.", "{what}: pedido."),
    "failed": ("{what}: {sentence} ({code})", "{what}: {sentence} ({code})"),
    "failed_plainly": ("{what}: {sentence}", "{what}: {sentence}"),
    "sent": ("{what}: queued.", "{what}: en la cola."),
    "list_sent": (
        "Queued {count} tasks as one job.",
        "{count} tareas puestas en la cola como un trabajo.",
    ),
    "list_waits": (
        "Queued {count} tasks as one job. It waits, because the queue is paused.",
        "{count} tareas puestas en la cola como un trabajo. Espera, porque la cola está en pausa.",
    ),
    "no_answer": ("The robot did not answer.", "El robot no respondió."),
    "layer_gone": (
        "The node that carried it out is gone; check the robot's position.",
        "El nodo que lo ejecutaba ya no está; compruebe la posición del robot.",
    ),
    "stop_unheard": (
        "No node confirmed the stop. Use the emergency stop at the machine.",
        "Ningún nodo confirmó la parada. Use la parada de emergencia de la máquina.",
    ),
    "shut_down": ("ROS asked this node to end.", "ROS pidió que este nodo termine."),
    # The events of the robot are in `EVENTS`; the dashboard adds this one.
    "event_refused": ("refused", "rechazado"),
}
"""English and Spanish by key; `{name}` is filled in."""


def word(key: str, language: str = "en", **details: object) -> str:
    """Return a word in a language (English for an unknown one), with its details filled in."""
    return WORDS[key][1 if language == "es" else 0].format(**details)


def phrase(key: str, language: str = "en") -> str:
    """Return a word; for an unknown key, as from another version, return the readable key."""
    return word(key, language) if key in WORDS else key.partition("_")[2].replace("_", " ") or key


SENTENCES = "sentences.json"
"""English and Spanish sentences of the errors by code; `scripts/gen_docs.py` writes the file from `maya_un.errors`."""

PHRASES = "phrases.json"
"""Spanish phrases by the English ones, written likewise; a phrase is a part of a sentence, as the reason in it."""

EVENTS = "events.json"
"""English and Spanish sentences of the events by word, written likewise from `maya_un.events`."""


@lru_cache(maxsize=None)
def _table(name: str) -> dict[str, Any]:
    try:
        return json.loads(resource(name).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}


def happened(word: str, detail: dict[str, Any], language: str = "en") -> tuple[str, dict[str, Any]]:
    """Return the sentence of an event in a language, and the details that the sentence leaves out.

    If the event is unknown, or lacks a detail, its readable word replaces the sentence.
    """
    english, other = _table(EVENTS).get(word, ["", ""])
    template = other if language == "es" else english
    names = {name for _, name, _, _ in Formatter().parse(template)}
    try:
        said = template.format(**detail)
    except (KeyError, ValueError, TypeError):
        said, names = "", set()
    return said or phrase(f"event_{word}", language), {key: detail[key] for key in detail if key not in names}


def sentence(code: str, message: str, language: str = "en") -> str:
    """Return the sentence of an error in a language, from its code and its English sentence.

    The details of the English sentence are filled into the other one; phrases among them are translated. An unknown
    sentence is returned unchanged.
    """
    english, other = _table(SENTENCES).get(code, ["", ""])
    if language == "en" or not other:
        return message
    return _filled(english, other, message) or message


def _filled(english: str, other: str, text: str) -> str:
    """Return a text of the template `english` in the other language, "" if it is not one."""
    details = _details(english, text)
    if details is None:
        return ""
    return re.sub(r"\{(\w+)[^}]*\}", lambda name: _phrase(details.get(name.group(1), "")), other)


def _phrase(text: str) -> str:
    """Return a phrase in Spanish, also one behind a name; any other text unchanged."""
    found = _table(PHRASES).get(text, "")
    for english, pieces in () if found else _templates():
        if all(piece in text for piece in pieces):
            found = found or _filled(english, _table(PHRASES)[english], text)
    head, colon, rest = text.partition(": ")
    return found or (head + colon + _phrase(rest) if colon else text)


@lru_cache(maxsize=None)
def _templates() -> list[tuple[str, list[str]]]:
    """Return the phrases with details, the longest first, each with the texts between its details."""
    split = [(english, re.split(r"\{\w+\}", english)) for english in _table(PHRASES)]
    return sorted((one for one in split if len(one[1]) > 1), key=lambda one: -sum(map(len, one[1])))


def _details(template: str, text: str) -> dict[str, str] | None:
    """Return the values that fill a template's names in a text, None if the text does not fit the template."""
    names: list[str] = []
    pattern = ""
    for piece, name in re.findall(r"((?:[^{]|\{(?!\w))*)(?:\{(\w+)[^}]*\})?", template):
        pattern += re.escape(piece)
        if name:
            pattern += f"(?P={name})" if name in names else f"(?P<{name}>.*?)"
            names.append(name)
    found = re.fullmatch(pattern, text, re.DOTALL)
    return None if found is None else found.groupdict()
