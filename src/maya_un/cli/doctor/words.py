"""What `maya doctor` says, in every language: what it means, and what to do (nothing where all is well)."""

from __future__ import annotations

from maya_un.cli.doctor.finding import Finding

_WORDS: dict[str, tuple[str, str, str, str]] = {
    "config_good": ("The configuration {path} is good.", "", "La configuración {path} es buena.", ""),
    "config_none": (
        "There is no configuration file: the manual's values hold.",
        "",
        "No hay archivo de configuración: valen los del manual.",
        "",
    ),
    "config_bad": (
        "{error}",
        "Correct it, then `maya config check`.",
        "{error}",
        "Corríjala; luego `maya config check`.",
    ),
    "coms_none": ("`maya coms` does not run at {url}.", "", "`maya coms` no funciona en {url}.", ""),
    "coms_other": (
        "`maya coms` at {url} is that of the robot {found}, not of {name}.",
        "Set coms.server_address to the address that the `maya coms` of {name} prints when it starts.",
        "`maya coms` en {url} es del robot {found}, no de {name}.",
        "Ponga en coms.server_address la dirección que muestra al arrancar el `maya coms` de {name}.",
    ),
    "coms_idle": (
        "`maya coms` runs at {url} and is not connected.",
        "",
        "`maya coms` funciona en {url} y no está conectado.",
        "",
    ),
    "coms_connected": (
        "`maya coms` is connected to the robot and to {where}.",
        "",
        "`maya coms` está conectado al robot y a {where}.",
        "",
    ),
    "coms_clear": (
        "`maya coms` sends its password to {where} without encryption: anyone on the network can read it.",
        "Use mqtts:// or https://.",
        "`maya coms` envía su contraseña a {where} sin cifrar: cualquiera en la red puede leerla.",
        "Use mqtts:// o https://.",
    ),
    "coms_taken": (
        "`maya coms` is disconnected from its supervisors: {reason}",
        "Until then the other robot gets the commands.",
        "`maya coms` está desconectado de sus supervisores: {reason}",
        "Hasta entonces, el otro robot recibe las órdenes.",
    ),
    "coms_waits": (
        "`maya coms` waits: {reason}",
        "Commands that arrive meanwhile stay with the supervisors' server.",
        "`maya coms` espera: {reason}",
        "Las órdenes que llegan entretanto quedan en el servidor de los supervisores.",
    ),
    "service_none": (
        "No `maya up` runs here.",
        "Start it, if commands are to reach a robot.",
        "Aquí no hay ningún `maya up` en marcha.",
        "Inícielo, si las órdenes han de llegar a un robot.",
    ),
    "service_gone": (
        "`maya up` (process {pid}) ended without cleaning up; nobody listens at {url}.",
        "Start `maya up` again; `maya logs` may tell what happened.",
        "`maya up` (proceso {pid}) terminó sin ordenar sus cosas; nadie escucha en {url}.",
        "Inicie `maya up` otra vez; `maya logs` puede contar qué pasó.",
    ),
    "service_hangs": (
        "`maya up` (process {pid}) listens at {url} but does not answer ({reason}).",
        "Stop the robot with `maya stop`, end the process, look at `maya logs`.",
        "`maya up` (proceso {pid}) escucha en {url} pero no responde ({reason}).",
        "Detenga el robot con `maya stop`, termine el proceso y mire `maya logs`.",
    ),
    "service_stranger": (
        "Somebody else answers at {url}, where `maya up` used to be.",
        "End what listens there, or start `maya up` with another `--port`.",
        "En {url}, donde estaba `maya up`, responde otro programa.",
        "Termine el que escucha allí, o inicie `maya up` con otro `--port`.",
    ),
    "service_runs": (
        "`maya up` (process {pid}) answers at {url}.",
        "",
        "`maya up` (proceso {pid}) responde en {url}.",
        "",
    ),
    "service_not_ready": ("{message}", "", "{message}", ""),
    "service_ready": ("It can carry wishes out.", "", "Puede cumplir deseos.", ""),
    "service_refuses": (
        "It answers, but not to you: {message}",
        "",
        "Responde, pero no a usted: {message}",
        "",
    ),
    "version_same": (
        "Command and service are of version {version}.",
        "",
        "Orden y servicio son de la versión {version}.",
        "",
    ),
    "version_differs": (
        "This command is of version {own}, the service that runs of version {version}.",
        "Restart `maya up` when the robot is at rest.",
        "Esta orden es de la versión {own}; el servicio en marcha, de la {version}.",
        "Reinicie `maya up` cuando el robot esté en reposo.",
    ),
    "robot_well": ("The robot on {address} is {mode}.", "", "El robot en {address} está {mode}.", ""),
    "robot_not_homed": (
        "The robot on {address} is not homed, so its position is not known.",
        "Say `maya home` before anything else moves.",
        "El robot en {address} no ha hecho el homing y no se conoce su posición.",
        "Diga `maya home` antes de mover nada más.",
    ),
    "robot_fault": (
        "The robot is in a fault ({code}): {message}",
        "",
        "El robot está en fallo ({code}): {message}",
        "",
    ),
    "robot_disconnected": (
        "The service has no connection to the controller at {address}.",
        "Check its power and cable. If it is on, reset it: sometimes only that gets it an IP address.",
        "El servicio no tiene conexión con el controlador en {address}.",
        "Revise alimentación y cable. Si está encendido, reinícielo: a veces solo así recibe una dirección IP.",
    ),
    "limits_active": (
        "Limit switches are active: {names}.",
        "Look whether the robot really stands on them.",
        "Finales de carrera activos: {names}.",
        "Mire si el robot está de verdad sobre ellos.",
    ),
    "limits_quiet": ("No limit switch is active.", "", "Ningún final de carrera está activo.", ""),
    "limits_both": (
        "Both limit switches of {axes} are active at once.",
        "Nothing can stand on both: check their power and cables, and `limit_active_level` in the configuration.",
        "Los dos finales de carrera de {axes} están activos a la vez.",
        "Nada puede estar sobre ambos: revise alimentación y cables, y `limit_active_level` en la configuración.",
    ),
    "level_same": (
        "The switches count as active at the level that the configuration says (CN {found}).",
        "",
        "Los finales de carrera se dan por activos al nivel que dice la configuración (CN {found}).",
        "",
    ),
    "torque_low": (
        "The torque limit of the lines is too low to lift anything ({found}), and no program owns the controller. A "
        "killed program left it.",
        "Start `maya up`: it sets the limits. Before you use another program, send `TL` with your own limits.",
        "El límite de par de los cables es demasiado bajo para levantar algo ({found}) y ningún programa es dueño del "
        "controlador. Lo dejó un programa terminado a la fuerza.",
        "Inicie `maya up`, que ajusta los límites. Antes de usar otro programa, envíe `TL` con sus propios límites.",
    ),
    "level_differs": (
        "The controller takes switches for active at CN {found}, the configuration says {wanted}.",
        "`maya up` sets it; if it was another program, end that first.",
        "El controlador da los finales de carrera por activos con CN {found}; la configuración dice {wanted}.",
        "`maya up` lo ajusta; si fue otro programa, termínelo antes.",
    ),
    "lease_free": ("Nobody drives.", "", "Nadie conduce.", ""),
    "lease_held": (
        "{holder} has been driving for {since:.0f} s.",
        "`maya lease ask` lets him know that you would like to; `maya stop` works for everybody.",
        "{holder} conduce desde hace {since:.0f} s.",
        "`maya lease ask` le hace saber que usted querría; `maya stop` funciona para todos.",
    ),
    "queue_runs": ("The queue is running.", "", "La cola está en marcha.", ""),
    "queue_paused": (
        "The queue is paused ({reason}); {waiting} wait.",
        "`maya queue` shows it, `maya queue resume` lets it go on.",
        "La cola está en pausa ({reason}); {waiting} en espera.",
        "`maya queue` la muestra, `maya queue resume` la continúa.",
    ),
    "queue_asks": (
        "Job {job} was interrupted, and waits for a person.",
        "`maya queue recover` shows what can be chosen.",
        "El trabajo {job} se interrumpió y espera a una persona.",
        "`maya queue recover` muestra qué se puede elegir.",
    ),
    "controller_asked": (
        "The controller was not asked by a handle of its own: the service is asked, and is not disturbed.",
        "",
        "No se preguntó al controlador por un canal propio: se pregunta al servicio, sin molestarlo.",
        "",
    ),
    "controller_twin": (
        "There is no controller to look at: sim is a twin within the program.",
        "",
        "No hay controlador que mirar: sim es un gemelo dentro del programa.",
        "",
    ),
    "controller_unnamed": (
        "No controller was looked at: none is configured.",
        "`maya doctor --address HOST` looks at one.",
        "No se miró ningún controlador: no hay ninguno configurado.",
        "`maya doctor --address HOST` mira uno.",
    ),
    "controller_silent": (
        "{error}",
        "Try it with Galil's own software. If it is on, reset it: sometimes only that gets it an IP address.",
        "{error}",
        "Pruebe con el programa de Galil. Si está encendido, reinícielo: a veces solo así recibe una dirección IP.",
    ),
    "controller_answers": (
        "The controller at {address} answers within {milliseconds:.1f} ms.",
        "",
        "El controlador en {address} responde en {milliseconds:.1f} ms.",
        "",
    ),
    "controller_wrong": ("{error}", "", "{error}", ""),
    "controller_refuses": (
        "It refuses to tell {command} ({reason}).",
        "If it is a DMC-41x3, look whether its firmware is an old one.",
        "Se niega a decir {command} ({reason}).",
        "Si es un DMC-41x3, mire si su firmware es antiguo.",
    ),
    "firmware": ("It is {firmware}.", "", "Es {firmware}.", ""),
    "handles_free": (
        "{free} of its {all} handles are free; this look has {own}; others: {others}.",
        "",
        "{free} de sus {all} canales están libres; esta consulta usa {own}; otros: {others}.",
        "",
    ),
    "handles_short": (
        "Only {free} of its {all} handles are free; others: {others}.",
        "End programs that keep one open; a reset gives all of them back.",
        "Solo {free} de sus {all} canales están libres; otros: {others}.",
        "Termine los programas que mantienen uno abierto; un reinicio los devuelve todos.",
    ),
    "controller_clock": (
        "Its clock runs: {counts:.0f} samples a second at TM {period:.0f}.",
        "",
        "Su reloj anda: {counts:.0f} muestras por segundo con TM {period:.0f}.",
        "",
    ),
    "controller_clock_off": (
        "Its clock counts {counts:.0f} samples a second at TM {period:.0f}, where 1024 are right at TM 1000.",
        "Somebody changed TM; `maya up` sets it. If TM is 1000, this computer was held up: look again.",
        "Su reloj cuenta {counts:.0f} muestras por segundo con TM {period:.0f}; lo correcto son 1024 con TM 1000.",
        "Alguien cambió TM; `maya up` lo ajusta. Si TM es 1000, este ordenador se retrasó: mire otra vez.",
    ),
    "owned": ("It belongs to {holder}.", "", "Pertenece a {holder}.", ""),
    "owned_by_nobody": ("No program owns it.", "", "Ningún programa lo posee.", ""),
    "program_none": ("No program runs in it.", "", "No se ejecuta ningún programa en él.", ""),
    "program_runs": (
        "A program runs in it (threads {threads}).",
        "Where it is Maya's guard, a `maya up` is connected from elsewhere; another one may move axes by itself.",
        "En él se ejecuta un programa (hilos {threads}).",
        "Si es el guardián de Maya, hay un `maya up` conectado desde otro sitio; cualquier otro puede mover ejes solo.",
    ),
    "motors_on": ("Its motors are on.", "", "Sus motores están encendidos.", ""),
    "motors_off": (
        "The motors of {axes} are off.",
        "`maya up` and `maya recover` switch them on.",
        "Los motores de {axes} están apagados.",
        "`maya up` y `maya recover` los encienden.",
    ),
    "controller_fault": ("{error}", "", "{error}", ""),
    "memory_sound": ("What is burned in it was sound at power-up.", "", "Lo grabado estaba sano al encenderse.", ""),
    "memory_damaged": (
        "It found what is burned damaged when it powered up (_RS {found:.0f}).",
        "Burn its parameters and programs again before anything moves.",
        "Encontró dañado lo grabado al encenderse (_RS {found:.0f}).",
        "Grabe otra vez sus parámetros y programas antes de mover nada.",
    ),
    "storage_good": (
        "The queue is kept in {path}: {runs} starts, {size:.1f} MB, sound.",
        "",
        "La cola se guarda en {path}: {runs} arranques, {size:.1f} MB, sana.",
        "",
    ),
    "storage_none": (
        "No queue has been kept in {path} yet; it can be.",
        "",
        "Aún no se ha guardado ninguna cola en {path}; se puede.",
        "",
    ),
    "storage_in_use": (
        "The queue in {path} is kept by the service (process {pid}), which says that it is well.",
        "",
        "La cola de {path} la lleva el servicio (proceso {pid}), que dice que está bien.",
        "",
    ),
    "storage_bad": ("{error}", "", "{error}", ""),
    "storage_unwritable": (
        "{path} cannot be written, so no job can be accepted.",
        "See to its owner and rights, or name another folder in MAYA_STATE_DIR.",
        "No se puede escribir en {path}, así que no se puede aceptar ningún trabajo.",
        "Revise su dueño y sus permisos, o nombre otra carpeta en MAYA_STATE_DIR.",
    ),
    "disk_room": (
        "{free:.1f} GB are free where the queue is kept.",
        "",
        "Quedan {free:.1f} GB donde se guarda la cola.",
        "",
    ),
    "disk_short": (
        "Only {free:.2f} GB are free where the queue is kept.",
        "Make room; recordings in {path} may be the largest part.",
        "Solo quedan {free:.2f} GB donde se guarda la cola.",
        "Haga sitio; las grabaciones en {path} pueden ser la mayor parte.",
    ),
    "port_free": ("Port {port} ({use}) is free.", "", "El puerto {port} ({use}) está libre.", ""),
    "port_ours": ("Port {port} ({use}) is held by {who}.", "", "El puerto {port} ({use}) lo tiene {who}.", ""),
    "port_taken": (
        "Port {port} ({use}) is held by {who}.",
        "End that program, or give `maya up` another `--port`.",
        "El puerto {port} ({use}) lo tiene {who}.",
        "Termine ese programa, o dé a `maya up` otro `--port`.",
    ),
    "certificate_good": (
        "The certificate at port {port} is good until {until}.",
        "",
        "El certificado del puerto {port} vale hasta el {until}.",
        "",
    ),
    "certificate_soon": (
        "The certificate at port {port} ends on {until}, in {days:.0f} days.",
        "Get a new one, and restart `maya up` with it.",
        "El certificado del puerto {port} vence el {until}, en {days:.0f} días.",
        "Consiga uno nuevo y reinicie `maya up` con él.",
    ),
    "certificate_expired": (
        "The certificate at port {port} has expired: nobody who looks at it connects.",
        "Get a new one, and restart `maya up` with it.",
        "El certificado del puerto {port} ha vencido: nadie que lo mire se conecta.",
        "Consiga uno nuevo y reinicie `maya up` con él.",
    ),
    "certificate_bad": (
        "The certificate at port {port} is not good ({reason}).",
        "Look at this computer's clock first; else get a new one, and restart `maya up` with it.",
        "El certificado del puerto {port} no es bueno ({reason}).",
        "Mire primero el reloj de este ordenador; si no, consiga uno nuevo y reinicie `maya up` con él.",
    ),
    "clock_good": (
        "This computer's clock is kept by {keeper}.",
        "",
        "El reloj de este ordenador lo ajusta {keeper}.",
        "",
    ),
    "clock_alone": (
        "Nobody seems to keep this computer's clock right.",
        "Dates of jobs and of tokens go by it: switch time synchronisation on (systemd-timesyncd or chrony).",
        "Nadie parece ajustar el reloj de este ordenador.",
        "Las fechas de trabajos y tokens van por él: active la sincronización horaria (systemd-timesyncd o chrony).",
    ),
    "clock_back": (
        "This computer's clock is {seconds:.0f} s behind the newest event that was kept.",
        "Set it right; until then tokens may count as expired, and histories are out of order.",
        "El reloj de este ordenador va {seconds:.0f} s por detrás del último evento guardado.",
        "Póngalo en hora; hasta entonces los tokens pueden darse por vencidos y los historiales salir desordenados.",
    ),
    "ros_none": (
        "ROS is not installed; Maya does not need it.",
        "",
        "ROS no está instalado; Maya no lo necesita.",
        "",
    ),
    "ros_master": (
        "ROS is installed, and its master answers at {uri}.",
        "",
        "ROS está instalado y su master responde en {uri}.",
        "",
    ),
    "ros_no_master": (
        "ROS is installed, but no master answers at {uri}.",
        "Start `roscore`, or set ROS_MASTER_URI, if the ROS nodes are wanted.",
        "ROS está instalado, pero ningún master responde en {uri}.",
        "Inicie `roscore` o ajuste ROS_MASTER_URI, si se quieren los nodos de ROS.",
    ),
    "check_failed": (
        "This could not be looked at ({reason}).",
        "Please report it with the log.",
        "Esto no se pudo mirar ({reason}).",
        "Por favor, comuníquelo con el registro.",
    ),
}

_CHECKS: dict[str, str] = {
    "configuration": "configuración",
    "service": "servicio",
    "version": "versión",
    "robot": "robot",
    "lease": "conducción",
    "queue": "cola",
    "controller": "controlador",
    "owner": "dueño",
    "torque": "par",
    "firmware": "firmware",
    "handles": "canales",
    "limits": "finales de carrera",
    "program": "programa",
    "motors": "motores",
    "memory": "memoria",
    "controller clock": "reloj del controlador",
    "storage": "almacén",
    "disk": "disco",
    "ports": "puertos",
    "clock": "reloj",
    "certificate": "certificado",
    "ROS": "ROS",
    "supervisors": "supervisores",
}
"""The names of the checks in Spanish; in English they are their own."""


def name(check: str, language: str) -> str:
    """Return the name of a check."""
    return _CHECKS[check] if language == "es" else check


def meaning(finding: Finding, language: str) -> str:
    """Return what a finding means, in one sentence."""
    words = _WORDS[finding.key]
    return (words[2] if language == "es" else words[0]).format(**finding.details)


def remedy(finding: Finding, language: str) -> str:
    """Return what to do about it, "" for nothing."""
    words = _WORDS[finding.key]
    return (words[3] if language == "es" else words[1]).format(**finding.details)
