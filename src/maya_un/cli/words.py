"""Texts of the command line, in every language; those of errors are in `maya_un.messages`."""

from __future__ import annotations

_WORDS: dict[str, tuple[str, str]] = {
    "stopping": (
        "Stopping: at rest within {seconds:.2f} s, after a {a:.2f}°, b {b:.1f} mm, c {c:.1f} mm.",
        "Deteniendo: en reposo en {seconds:.2f} s, tras a {a:.2f}°, b {b:.1f} mm, c {c:.1f} mm.",
    ),
    "nothing_moved": ("Nothing was moving.", "Nada se movía."),
    "stopped_directly": (
        "Stop sent directly to the controller at {address}: {axes} began to brake.",
        "Parada enviada directamente al controlador en {address}: {axes} empezaron a frenar.",
    ),
    "quiet_directly": (
        "Stop sent directly to the controller at {address}: nothing was moving.",
        "Parada enviada directamente al controlador en {address}: nada se movía.",
    ),
    "aborted": (
        "Aborted: the axes are at rest. `maya recover` switches motors on that went off.",
        "Abortado: los ejes están en reposo. `maya recover` enciende los motores que se apagaron.",
    ),
    "recovered": ("Recovered: the fault is cleared.", "Recuperado: el fallo se ha borrado."),
    "pausing": (
        "Pausing: at rest within {seconds:.2f} s. `maya resume` continues.",
        "Pausando: en reposo en {seconds:.2f} s. `maya resume` continúa.",
    ),
    "paused": ("Paused. `maya resume` continues.", "En pausa. `maya resume` continúa."),
    "resumed": ("Resumed.", "Reanudado."),
    "speed": ("Speed {percent:g} % from now on.", "Velocidad {percent:g} % desde ahora."),
    "speed_is": ("speed {percent:g} %", "velocidad {percent:g} %"),
    "jogged": ("{axis} by {way}.", "{axis} en {way}."),
    "jogged_to_limit": ("{axis} by {way}. Stopped because {reason}.", "{axis} en {way}. Parado porque {reason}."),
    "done": ("Done.", "Hecho."),
    "homed": ("homed", "con homing"),
    "gripper_closed": ("gripper closed", "pinza cerrada"),
    "gripper_open": ("gripper open", "pinza abierta"),
    "controller": ("controller {address}", "controlador {address}"),
    "progress": ("{phase}: {elapsed:.1f} of {duration:.1f} s", "{phase}: {elapsed:.1f} de {duration:.1f} s"),
    "progress_untimed": ("{phase}: since {elapsed:.1f} s", "{phase}: desde hace {elapsed:.1f} s"),
    "no_position": ("position unknown until homed", "posición desconocida hasta el homing"),
    "fault": ("fault {code}: {message}", "fallo {code}: {message}"),
    "queue": ("{running} running, {waiting} waiting", "{running} en marcha, {waiting} en espera"),
    "limits": ("limit switches active: {names}", "finales de carrera activos: {names}"),
    "ready": (
        "Maya is up on {address}, clock × {speed:g}. Service: {url}",
        "Maya está en marcha en {address}, reloj × {speed:g}. Servicio: {url}",
    ),
    "next": (
        "Next, in another terminal: maya home · maya status · maya run JOB · maya stop.\nCtrl-C ends it.",
        "Ahora, en otra terminal: maya home · maya status · maya run JOB · maya stop.\nCtrl-C la termina.",
    ),
    "ready_far": ("For other machines, with a token: {url}", "Para otras máquinas, con un token: {url}"),
    "ready_rosbridge": ("rosbridge: {url}", "rosbridge: {url}"),
    "was_interrupted": (
        "Job {job} ({name}) was interrupted at step {index}, {step}. Nothing moves by itself: "
        "`maya queue` shows the job, `maya queue recover` decides about it.",
        "El trabajo {job} ({name}) se interrumpió en el paso {index}, {step}. Nada se mueve por "
        "sí solo: `maya queue` muestra el trabajo, `maya queue recover` decide sobre él.",
    ),
    "was_interrupted_between": (
        "Job {job} ({name}) was interrupted between two steps. Nothing moves by itself: `maya "
        "queue` shows the job, `maya queue recover` decides about it.",
        "El trabajo {job} ({name}) se interrumpió entre dos pasos. Nada se mueve por sí solo: "
        "`maya queue` muestra el trabajo, `maya queue recover` decide sobre él.",
    ),
    "still_waiting_paused": (
        "Waiting jobs from before: {count}; the queue is paused ({reason}). `maya queue resume` continues.",
        "Trabajos en espera de antes: {count}; la cola está en pausa ({reason}). `maya queue resume` continúa.",
    ),
    "still_waiting_asked": (
        "Jobs waiting behind it: {count}.",
        "Trabajos que esperan detrás: {count}.",
    ),
    "still_waiting": ("Waiting jobs from before: {count}.", "Trabajos en espera de antes: {count}."),
    "ending": ("Ending.", "Terminando."),
    "ending_stop": (
        "Ending: job {job} stops on its path and stays interrupted; a person decides about it at the next start.",
        "Terminando: el trabajo {job} se detiene sobre su camino y queda interrumpido; en el "
        "próximo arranque una persona decide sobre él.",
    ),
    "ending_finish": (
        "Ending after the running step of job {job}; repeat the command to stop now.",
        "Terminando tras el paso en marcha del trabajo {job}; repita la orden para detener ahora.",
    ),
    "ending_hurried": ("Stopping on the path now.", "Deteniendo ya sobre el camino."),
    "going_down": ("Asked `maya up` to end; waiting for it.", "Se pidió a `maya up` que termine; esperando."),
    "went_down": ("`maya up` has ended.", "`maya up` ha terminado."),
    "twin": ("On the twin, clock × {speed:g}.", "En el gemelo, reloj × {speed:g}."),
    "dry": ("Dry run on the twin: nothing real moves.", "Ensayo en el gemelo: nada real se mueve."),
    "on": ("On the controller at {address}.", "En el controlador en {address}."),
    "with_service": ("With the running robot at {url}.", "Con el robot en marcha en {url}."),
    "interrupted": ("Interrupted: stopping on the path.", "Interrumpido: deteniendo sobre el camino."),
    "job": ("{name}: {state} in {duration:.1f} s", "{name}: {state} en {duration:.1f} s"),
    "lowest": ("gripper between {lowest:.3f} m and {highest:.3f} m", "pinza entre {lowest:.3f} m y {highest:.3f} m"),
    "step": ("step", "paso"),
    "result": ("result", "resultado"),
    "predicted": ("predicted [s]", "previsto [s]"),
    "took": ("took [s]", "duró [s]"),
    "part": ("part", "pieza"),
    "place": ("place [m]", "lugar [m]"),
    "off": ("off by [mm]", "desvío [mm]"),
    "reachable": ("reachable", "alcanzable"),
    "out_of_reach": ("not reachable: {reason}; nearest {nearest}", "no alcanzable: {reason}; lo más cercano {nearest}"),
    "also": ("also: {reason}", "además: {reason}"),
    "nowhere": ("nothing: the zones leave no place", "nada: las zonas no dejan ningún lugar"),
    "tensions": (
        "line b carries {b:.3f} × load, line c {c:.3f} × load",
        "el cable b lleva {b:.3f} × carga, el cable c {c:.3f} × carga",
    ),
    "loads": ("{loads:.3f} × load", "{loads:.3f} × carga"),
    "limit": ("limit", "límite"),
    "margin": ("margin", "margen"),
    "limit_coupling": ("lines b and c meet", "los cables b y c se alcanzan"),
    "limit_boom": ("range of the boom", "giro del brazo"),
    "limit_inner": ("inner anchor", "anclaje interior"),
    "limit_outer": ("outer anchor", "anclaje exterior"),
    "limit_floor": ("table top", "mesa"),
    "limit_line_b": ("ends of line b", "extremos del cable b"),
    "limit_line_c": ("ends of line c", "extremos del cable c"),
    "limit_tension_b": ("tension of line b", "tensión del cable b"),
    "limit_tension_c": ("tension of line c", "tensión del cable c"),
    "limit_zone": ("zone {zone}", "zona {zone}"),
    "zone": ("zone", "zona"),
    "kind": ("kind", "clase"),
    "as_written": ("as it is written", "como se escribe"),
    "no_zones": ("There are no zones.", "No hay zonas."),
    "zones_of_this_run": (
        "This change lasts until `maya up` ends. Write permanent zones into the configuration, in [[zones]].",
        "Este cambio dura hasta que termine `maya up`. Escriba las zonas permanentes en la "
        "configuración, en [[zones]].",
    ),
    "zone_added": ("Keeping out of {name}.", "Se evita {name}."),
    "zone_removed": ("No longer keeping out of {name}.", "Ya no se evita {name}."),
    "taught": ("Taught {name}: {place}", "Enseñado {name}: {place}"),
    "forgotten": ("Forgotten: {name}", "Olvidado: {name}"),
    "renamed": ("{old} is now {new}.", "{old} es ahora {new}."),
    "no_poses": (
        "No poses have been taught; teach one with `maya teach NAME`.",
        "No hay poses enseñadas; enseñe una con `maya teach NOMBRE`.",
    ),
    "no_pallets": (
        "No pallets have been taught; teach one with `maya teach-pallet`.",
        "No hay palés enseñados; enseñe uno con `maya teach-pallet`.",
    ),
    "name": ("name", "nombre"),
    "joints": ("joints", "articulaciones"),
    "taught_on": ("taught", "enseñado"),
    "pallet": ("{name}, {rows} x {columns}", "{name}, {rows} x {columns}"),
    "out_of_shape": ("not quite a rectangle", "no es del todo un rectángulo"),
    "drive_to": (
        "Drive the gripper to cell [{row},{column}] and press Enter, or type the name of a taught pose:",
        "Lleve la pinza a la celda [{row},{column}] y pulse Intro, o escriba el nombre de una pose enseñada:",
    ),
    "drive_to_last": (
        "Drive the gripper to the last cell [{row},{column}] and press Enter, type the name of a "
        "taught pose, or type - to skip it:",
        "Lleve la pinza a la última celda [{row},{column}] y pulse Intro, escriba el nombre de una pose enseñada, o - "
        "para omitirla:",
    ),
    "nearest_limit": ("nearest limits:", "límites más cercanos:"),
    "pendant_stopping": ("Stopping: at rest within {seconds:.2f} s.", "Deteniendo: en reposo en {seconds:.2f} s."),
    "pendant_not_stopped": (
        "NOT STOPPED: {reason} Press the emergency stop.",
        "NO SE DETUVO: {reason} Pulse la parada de emergencia.",
    ),
    "pendant_name": (
        "Name of this pose (! after it replaces; Esc cancels): ",
        "Nombre de esta pose (con ! detrás reemplaza; Esc cancela): ",
    ),
    "pendant_keys": (
        "x y z r a b c  forward   X Y Z R A B C  back   arrows x, y   PgUp PgDn z   1 2 3  "
        "step\nSPACE  STOP   t  teach a pose   q  end",
        "x y z r a b c  adelante   X Y Z R A B C  atrás   flechas x, y   RePág AvPág z   1 2 3  paso\n"
        "ESPACIO  PARAR   t  enseñar una pose   q  terminar",
    ),
    "config_good": ("{path} is a valid configuration.", "{path} es una configuración válida."),
    "config_defaults": ("no file at {path}: the manual's values apply", "sin archivo en {path}: valen los del manual"),
    "config_written": ("Written: {path}", "Escrito: {path}"),
    "picture": ("Picture: {path}", "Imagen: {path}"),
    "no_faults": ("No fault is active.", "Ningún fallo está activo."),
    "fault_ends": ("for {seconds:.1f} s more", "durante {seconds:.1f} s más"),
    "left": ("left", "faltan"),
    "record_reason": ("reason", "motivo"),
    "record_size": ("size", "tamaño"),
    "no_recordings": ("There are no recordings in {folder}.", "No hay grabaciones en {folder}."),
    "record_saved": ("Saved: {name}", "Guardada: {name}"),
    "record_of": (
        "{reason}, saved {date}, the last {seconds:.1f} s",
        "{reason}, guardada {date}, los últimos {seconds:.1f} s",
    ),
    "record_holds": ("{states} states, {wire} pieces of the wire", "{states} estados, {wire} trozos de la línea"),
    "replay_time": ("time [s]", "tiempo [s]"),
    "replay_what": ("what", "qué"),
    "replay_how": ("how", "cómo"),
    "replay_more": ("and {count} more; --json has all.", "y {count} más; --json los tiene todos."),
    "replay_axis": ("axis", "eje"),
    "replay_recorded": ("recorded, at its end [counts]", "grabado, al final [cuentas]"),
    "replay_replayed": ("replayed", "repetido"),
    "replay_motions": ("{count} motions, {seconds:.1f} s in all.", "{count} movimientos, {seconds:.1f} s en total."),
    "replayed_twin": (
        "{compared} answers compared; {differences} differences.",
        "{compared} respuestas comparadas; {differences} diferencias.",
    ),
    "cannot_house": (
        "Not compared: jobs, steps and the queue, because the controller does not know them.",
        "No se compara: trabajos, pasos y la cola, porque el controlador no los conoce.",
    ),
    "cannot_machine": (
        "Different from the machine: friction, lag, stiffness, and registers that Maya does not "
        "set. They are the twin's.",
        "Distinto de la máquina: fricción, retraso, rigidez y registros que Maya no fija. Son los del gemelo.",
    ),
    "cannot_place": (
        "Different: the position of the machine before homing, which its counts do not tell.",
        "Distinto: la posición de la máquina antes del homing, que sus cuentas no indican.",
    ),
    "cannot_opening": (
        "Different: registers, program and variables from before the recording, which does not contain them.",
        "Distinto: registros, programa y variables anteriores a la grabación, que no los contiene.",
    ),
    "cannot_datagrams": (
        "Not compared: unsolicited data records, by UDP.",
        "No se compara: registros de datos no solicitados, por UDP.",
    ),
}


def word(key: str, language: str, **details: object) -> str:
    """Return the words of `key` in `language`, with their details filled in."""
    english, spanish = _WORDS[key]
    return (spanish if language == "es" else english).format(**details)
