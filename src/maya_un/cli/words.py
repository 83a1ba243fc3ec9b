"""What the command line says of itself, in every language; errors have their words in `maya_un.messages`."""

from __future__ import annotations

_WORDS: dict[str, tuple[str, str]] = {
    "stopping": (
        "Stopping: at rest within {seconds:.2f} s; still to go a {a:.2f}°, b {b:.1f} mm, c {c:.1f} mm.",
        "Deteniendo: en reposo en {seconds:.2f} s; quedan a {a:.2f}°, b {b:.1f} mm, c {c:.1f} mm.",
    ),
    "nothing_moved": ("Nothing was moving.", "Nada se movía."),
    "stopped_directly": (
        "The controller at {address} was told directly: {axes} began to brake.",
        "Se avisó directamente al controlador en {address}: {axes} empezaron a frenar.",
    ),
    "quiet_directly": (
        "The controller at {address} was told directly: nothing was moving.",
        "Se avisó directamente al controlador en {address}: nada se movía.",
    ),
    "aborted": (
        "Aborted: the axes stand. Motors that went off come back with `maya recover`.",
        "Abortado: los ejes están quietos. Los motores que se apagaron vuelven con `maya recover`.",
    ),
    "recovered": ("Recovered: no fault any more.", "Recuperado: ya no hay fallo."),
    "pausing": (
        "Pausing: at rest within {seconds:.2f} s. `maya resume` goes on.",
        "Pausando: en reposo en {seconds:.2f} s. `maya resume` continúa.",
    ),
    "paused": ("Paused. `maya resume` goes on.", "En pausa. `maya resume` continúa."),
    "resumed": ("Going on.", "Continúa."),
    "speed": ("Speed {percent:g} % from now on.", "Velocidad {percent:g} % desde ahora."),
    "speed_is": ("speed {percent:g} %", "velocidad {percent:g} %"),
    "jogged": ("{axis} by {way}.", "{axis} en {way}."),
    "jogged_to_limit": ("{axis} by {way}. Farther on, {reason}.", "{axis} en {way}. Más allá, {reason}."),
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
        "Maya is up on {address}, clock × {speed:g}. Door: {url}",
        "Maya está en marcha en {address}, reloj × {speed:g}. Puerta: {url}",
    ),
    "next": (
        "Next, in another terminal: maya home · maya status · maya run JOB · maya stop.\nCtrl-C ends it.",
        "Ahora, en otra terminal: maya home · maya status · maya run JOB · maya stop.\nCtrl-C la termina.",
    ),
    "ready_far": ("For other machines, with a token: {url}", "Para otras máquinas, con un token: {url}"),
    "ready_rosbridge": ("rosbridge: {url}", "rosbridge: {url}"),
    "was_interrupted": (
        "Job {job} ({name}) was interrupted at step {index}, {step}. Nothing moves by itself: `maya queue` shows it, "
        "`maya queue recover` says what becomes of it.",
        "El trabajo {job} ({name}) se interrumpió en el paso {index}, {step}. Nada se mueve por sí solo: `maya queue` "
        "lo muestra, `maya queue recover` decide qué será de él.",
    ),
    "was_interrupted_between": (
        "Job {job} ({name}) was interrupted between two steps. Nothing moves by itself: `maya queue` shows it, "
        "`maya queue recover` says what becomes of it.",
        "El trabajo {job} ({name}) se interrumpió entre dos pasos. Nada se mueve por sí solo: `maya queue` lo muestra, "
        "`maya queue recover` decide qué será de él.",
    ),
    "still_waiting_paused": (
        "Jobs that wait from before: {count}; the queue is paused ({reason}). `maya queue resume` goes on.",
        "Trabajos que esperan de antes: {count}; la cola está en pausa ({reason}). `maya queue resume` continúa.",
    ),
    "still_waiting_asked": (
        "Jobs that wait behind it: {count}.",
        "Trabajos que esperan detrás: {count}.",
    ),
    "still_waiting": ("Jobs that wait from before: {count}.", "Trabajos que esperan de antes: {count}."),
    "ending": ("Ending.", "Terminando."),
    "ending_stop": (
        "Ending: job {job} stops on its path and stays interrupted; a person says at the next start what becomes of "
        "it.",
        "Terminando: el trabajo {job} se detiene sobre su camino y queda interrumpido; en el próximo arranque una "
        "persona dice qué será de él.",
    ),
    "ending_finish": (
        "Ending after the step of job {job} that is under way; say it again to stop now.",
        "Terminando tras el paso en marcha del trabajo {job}; repítalo para detener ahora.",
    ),
    "ending_hurried": ("Stopping on the path now.", "Deteniendo ya sobre el camino."),
    "going_down": ("Asked to end; waiting until it has.", "Se pidió terminar; esperando a que lo haga."),
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
        "What is changed here holds for this run only; what is to stay stands in the configuration, in [[zones]].",
        "Lo que se cambia aquí vale mientras siga en marcha; lo que debe quedar va en la configuración, en [[zones]].",
    ),
    "zone_added": ("Keeping out of {name}.", "Se evita {name}."),
    "zone_removed": ("No longer keeping out of {name}.", "Ya no se evita {name}."),
    "taught": ("Taught {name}: {place}", "Enseñado {name}: {place}"),
    "forgotten": ("Forgotten: {name}", "Olvidado: {name}"),
    "renamed": ("{old} is now {new}.", "{old} es ahora {new}."),
    "no_poses": ("No poses have been taught; `maya teach NAME`.", "No hay poses enseñadas; `maya teach NOMBRE`."),
    "no_pallets": ("No pallets have been taught; `maya teach-pallet`.", "No hay palés enseñados; `maya teach-pallet`."),
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
        "Drive the gripper to the last cell [{row},{column}] and press Enter, type the name of a taught pose, or - to "
        "leave it out:",
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
        "Name of this pose (! behind it replaces; Esc leaves it): ",
        "Nombre de esta pose (con ! detrás reemplaza; Esc la deja): ",
    ),
    "pendant_keys": (
        "x y z r a b c  forth   X Y Z R A B C  back   arrows x, y   PgUp PgDn z   1 2 3  step\n"
        "SPACE  STOP   t  teach a pose   q  end",
        "x y z r a b c  adelante   X Y Z R A B C  atrás   flechas x, y   RePág AvPág z   1 2 3  paso\n"
        "ESPACIO  PARAR   t  enseñar una pose   q  terminar",
    ),
    "config_good": ("{path} is a good configuration.", "{path} es una buena configuración."),
    "config_defaults": ("no file at {path}: the manual's values hold", "sin archivo en {path}: valen los del manual"),
    "config_written": ("Written: {path}", "Escrito: {path}"),
    "picture": ("Picture: {path}", "Imagen: {path}"),
    "no_faults": ("Nothing is wrong with it.", "No le pasa nada."),
    "fault_ends": ("for {seconds:.1f} s more", "durante {seconds:.1f} s más"),
    "left": ("left", "faltan"),
    "captures": (
        "Listening on {address} for {controller}. Ctrl-C ends the recording.",
        "Escuchando en {address} para {controller}. Ctrl-C termina la grabación.",
    ),
    "replayed": (
        "{commands} commands, {differences} answered otherwise than recorded.",
        "{commands} comandos, {differences} con otra respuesta que la grabada.",
    ),
    "record_reason": ("why", "por qué"),
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
        "Not compared: jobs, steps and the queue, which this program makes and the controller knows nothing of.",
        "No se compara: trabajos, pasos y la cola, que hace este programa y de los que el controlador no sabe nada.",
    ),
    "cannot_machine": (
        "Not as it was: its friction, lag and stiffness, and registers that Maya does not set; they are a twin's.",
        "No es como era: fricción, retraso y rigidez de la máquina, registros que Maya no fija; son de un gemelo.",
    ),
    "cannot_place": (
        "Not as it was: where the machine stood before it was homed; its counts did not say.",
        "No es como era: dónde estaba la máquina antes del homing; sus cuentas no lo decían.",
    ),
    "cannot_opening": (
        "Not as it was: registers, program and variables from before the recording; what configured them is not in it.",
        "No es como era: registros, programa y variables anteriores; lo que los configuró no está en la grabación.",
    ),
    "cannot_datagrams": (
        "Not compared: data records that came by themselves, by UDP.",
        "No se compara: registros de datos que llegaron por sí mismos, por UDP.",
    ),
    "sent": ("sent", "enviado"),
    "expected": ("expected", "esperado"),
    "received": ("received", "recibido"),
    "known_from": ("known from", "según"),
    "two": ("two sources", "dos fuentes"),
    "one": ("one source", "una fuente"),
    "inferred": ("inferred", "deducido"),
    "conforms": (
        "{right} answers are right, {differ} differ; {left} questions were not asked (--moves and --bench allow more).",
        "{right} respuestas son correctas, {differ} difieren; {left} preguntas no se hicieron (--moves y --bench "
        "permiten más).",
    ),
}


def word(key: str, language: str, **details: object) -> str:
    """Return the words of `key` in `language`, with their details filled in."""
    english, spanish = _WORDS[key]
    return (spanish if language == "es" else english).format(**details)
