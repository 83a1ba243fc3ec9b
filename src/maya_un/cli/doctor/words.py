"""Texts of `maya doctor`, in every language: what it means, and what to do (nothing where all is well)."""

from __future__ import annotations

from maya_un.cli.doctor.finding import Finding

_WORDS: dict[str, tuple[str, str, str, str]] = {
    "config_good": ("The configuration {path} is valid.", "", "La configuración {path} es válida.", ""),
    "config_none": (
        "There is no configuration file: the manual's values apply.",
        "",
        "No hay archivo de configuración: valen los del manual.",
        "",
    ),
    "config_bad": (
        "{error}",
        "Correct it, then run `maya config check`.",
        "{error}",
        "Corríjala y ejecute `maya config check`.",
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
        "To command a robot, start it.",
        "Aquí no hay ningún `maya up` en marcha.",
        "Para mandar un robot, inícielo.",
    ),
    "service_gone": (
        "`maya up` (process {pid}) ended without cleaning up; no program listens at {url}.",
        "Start `maya up` again; `maya logs` may show the cause.",
        "`maya up` (proceso {pid}) terminó sin limpiar; ningún programa escucha en {url}.",
        "Inicie `maya up` otra vez; `maya logs` puede mostrar la causa.",
    ),
    "service_hangs": (
        "`maya up` (process {pid}) listens at {url} but does not answer ({reason}).",
        "Stop the robot with `maya stop`, end the process, then read `maya logs`.",
        "`maya up` (proceso {pid}) escucha en {url} pero no responde ({reason}).",
        "Detenga el robot con `maya stop`, termine el proceso y mire `maya logs`.",
    ),
    "service_stranger": (
        "Another program answers at {url}, the address of the former `maya up`.",
        "End the program that listens there, or start `maya up` with another `--port`.",
        "Otro programa responde en {url}, la dirección del `maya up` anterior.",
        "Termine el que escucha allí, o inicie `maya up` con otro `--port`.",
    ),
    "service_runs": (
        "`maya up` (process {pid}) answers at {url}.",
        "",
        "`maya up` (proceso {pid}) responde en {url}.",
        "",
    ),
    "service_not_ready": ("{message}", "", "{message}", ""),
    "service_ready": ("Ready for commands.", "", "Listo para recibir órdenes.", ""),
    "service_refuses": (
        "It answers, but refuses your request: {message}",
        "",
        "Responde, pero rechaza su petición: {message}",
        "",
    ),
    "version_same": (
        "Command and service have version {version}.",
        "",
        "La orden y el servicio tienen la versión {version}.",
        "",
    ),
    "version_differs": (
        "This command has version {own}, but the running service has version {version}.",
        "Restart `maya up` when the robot is at rest.",
        "Esta orden tiene la versión {own}, pero el servicio en marcha tiene la {version}.",
        "Reinicie `maya up` cuando el robot esté en reposo.",
    ),
    "robot_well": ("The robot on {address} is {mode}.", "", "El robot en {address} está {mode}.", ""),
    "robot_not_homed": (
        "The robot on {address} is not homed, so its position is not known.",
        "Run `maya home` before any other motion.",
        "El robot en {address} no ha hecho el homing y no se conoce su posición.",
        "Ejecute `maya home` antes de cualquier otro movimiento.",
    ),
    "robot_fault": (
        "The robot is in a fault ({code}): {message}",
        "",
        "El robot está en fallo ({code}): {message}",
        "",
    ),
    "robot_disconnected": (
        "The service has no connection to the controller at {address}.",
        "Check its power and cable. If it is on, reset it: sometimes it gets an IP address only then.",
        "El servicio no tiene conexión con el controlador en {address}.",
        "Revise alimentación y cable. Si está encendido, reinícielo: a veces solo así recibe una dirección IP.",
    ),
    "limits_active": (
        "Limit switches are active: {names}.",
        "Check whether the robot really stands on them.",
        "Finales de carrera activos: {names}.",
        "Mire si el robot está de verdad sobre ellos.",
    ),
    "limits_quiet": ("No limit switch is active.", "", "Ningún final de carrera está activo.", ""),
    "limits_both": (
        "Both limit switches of {axes} are active at once.",
        "An axis cannot stand on both: check their power and cables, and `limit_active_level` in the configuration.",
        "Los dos finales de carrera de {axes} están activos a la vez.",
        "Nada puede estar sobre ambos: revise alimentación y cables, y `limit_active_level` en la configuración.",
    ),
    "level_same": (
        "The switches are active at the configured level (CN {found}).",
        "",
        "Los finales de carrera son activos al nivel configurado (CN {found}).",
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
        "The controller reads switches as active at CN {found}, but the configuration says {wanted}.",
        "`maya up` sets it. If another program changed it, end that program first.",
        "El controlador lee los finales de carrera como activos con CN {found}, pero la configuración dice {wanted}.",
        "`maya up` lo ajusta. Si lo cambió otro programa, termínelo antes.",
    ),
    "lease_free": ("Nobody drives.", "", "Nadie conduce.", ""),
    "lease_held": (
        "{holder} has been driving for {since:.0f} s.",
        "`maya lease ask` asks the driver for the lease; `maya stop` works for everybody.",
        "{holder} conduce desde hace {since:.0f} s.",
        "`maya lease ask` pide el mando a quien conduce; `maya stop` funciona para todos.",
    ),
    "queue_runs": ("The queue is running.", "", "La cola está en marcha.", ""),
    "queue_paused": (
        "The queue is paused ({reason}); {waiting} jobs are waiting.",
        "`maya queue` shows it, `maya queue resume` continues it.",
        "La cola está en pausa ({reason}); {waiting} trabajos en espera.",
        "`maya queue` la muestra, `maya queue resume` la continúa.",
    ),
    "queue_asks": (
        "Job {job} was interrupted, and waits for a person.",
        "`maya queue recover` shows the choices.",
        "El trabajo {job} se interrumpió y espera a una persona.",
        "`maya queue recover` muestra las opciones.",
    ),
    "controller_asked": (
        "The controller was checked through the running service, without a second connection.",
        "",
        "El controlador se comprobó a través del servicio en marcha, sin una segunda conexión.",
        "",
    ),
    "controller_twin": (
        "There is no controller to check: sim is a twin within the program.",
        "",
        "No hay controlador que comprobar: sim es un gemelo dentro del programa.",
        "",
    ),
    "controller_unnamed": (
        "No controller was checked: none is configured.",
        "`maya doctor --address HOST` checks one.",
        "No se comprobó ningún controlador: no hay ninguno configurado.",
        "`maya doctor --address HOST` comprueba uno.",
    ),
    "controller_silent": (
        "{error}",
        "Try Galil's own software. If the controller is on, reset it: sometimes it gets an IP address only then.",
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
        "The controller refuses the command {command} ({reason}).",
        "If it is a DMC-41x3, check whether its firmware is old.",
        "El controlador rechaza el comando {command} ({reason}).",
        "Si es un DMC-41x3, compruebe si su firmware es antiguo.",
    ),
    "firmware": ("It is {firmware}.", "", "Es {firmware}.", ""),
    "handles_free": (
        "{free} of its {all} handles are free; this check uses {own}; others: {others}.",
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
        "Its clock counts {counts:.0f} samples a second at TM {period:.0f}; 1024 at TM 1000 are right.",
        "Another program changed TM; `maya up` sets it. If TM is 1000, this computer was overloaded: check again.",
        "Su reloj cuenta {counts:.0f} muestras por segundo con TM {period:.0f}; lo correcto son 1024 con TM 1000.",
        "Otro programa cambió TM; `maya up` lo ajusta. Si TM es 1000, este ordenador estaba "
        "sobrecargado: compruebe otra vez.",
    ),
    "owned": ("It belongs to {holder}.", "", "Pertenece a {holder}.", ""),
    "owned_by_nobody": ("No program owns it.", "", "Ningún programa lo posee.", ""),
    "program_none": ("No program runs in it.", "", "No se ejecuta ningún programa en él.", ""),
    "program_runs": (
        "A program runs in it (threads {threads}).",
        "If it is Maya's guard, a `maya up` on another computer is connected. Another program may move axes by itself.",
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
    "memory_sound": (
        "Its burned memory was intact at power-up.",
        "",
        "Su memoria grabada estaba intacta al encenderse.",
        "",
    ),
    "memory_damaged": (
        "The controller found its burned memory damaged when it powered up (_RS {found:.0f}).",
        "Burn its parameters and programs again before any motion.",
        "El controlador encontró dañada su memoria grabada al encenderse (_RS {found:.0f}).",
        "Grabe otra vez sus parámetros y programas antes de mover nada.",
    ),
    "storage_good": (
        "The queue is stored in {path}: {runs} starts, {size:.1f} MB, intact.",
        "",
        "La cola se guarda en {path}: {runs} arranques, {size:.1f} MB, intacta.",
        "",
    ),
    "storage_none": (
        "No queue is stored in {path} yet. The folder can be written.",
        "",
        "Aún no se ha guardado ninguna cola en {path}. Se puede escribir en la carpeta.",
        "",
    ),
    "storage_in_use": (
        "The service (process {pid}) uses the queue in {path}, and reports no problem.",
        "",
        "El servicio (proceso {pid}) usa la cola de {path} y no informa de problemas.",
        "",
    ),
    "storage_bad": ("{error}", "", "{error}", ""),
    "storage_unwritable": (
        "{path} cannot be written, so no job can be accepted.",
        "Correct its owner and permissions, or name another folder in MAYA_STATE_DIR.",
        "No se puede escribir en {path}, así que no se puede aceptar ningún trabajo.",
        "Revise su dueño y sus permisos, o nombre otra carpeta en MAYA_STATE_DIR.",
    ),
    "disk_room": (
        "{free:.1f} GB are free on the disk of the queue.",
        "",
        "Quedan {free:.1f} GB en el disco de la cola.",
        "",
    ),
    "disk_short": (
        "Only {free:.2f} GB are free on the disk of the queue.",
        "Free space; recordings in {path} may be the largest part.",
        "Solo quedan {free:.2f} GB en el disco de la cola.",
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
        "The certificate at port {port} is valid until {until}.",
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
        "The certificate at port {port} has expired: clients that check it do not connect.",
        "Get a new one, and restart `maya up` with it.",
        "El certificado del puerto {port} ha vencido: los clientes que lo comprueban no se conectan.",
        "Consiga uno nuevo y reinicie `maya up` con él.",
    ),
    "certificate_bad": (
        "The certificate at port {port} is not valid ({reason}).",
        "Check this computer's clock first. If it is right, get a new certificate, and restart `maya up` with it.",
        "El certificado del puerto {port} no es válido ({reason}).",
        "Revise primero el reloj de este ordenador. Si es correcto, consiga un certificado nuevo "
        "y reinicie `maya up` con él.",
    ),
    "clock_good": (
        "{keeper} synchronises this computer's clock.",
        "",
        "{keeper} sincroniza el reloj de este ordenador.",
        "",
    ),
    "clock_alone": (
        "Nothing seems to synchronise this computer's clock.",
        "Dates of jobs and tokens use it: switch time synchronisation on (systemd-timesyncd or chrony).",
        "Nada parece sincronizar el reloj de este ordenador.",
        "Las fechas de trabajos y tokens van por él: active la sincronización horaria (systemd-timesyncd o chrony).",
    ),
    "clock_back": (
        "This computer's clock is {seconds:.0f} s behind the newest stored event.",
        "Set the clock. Until then tokens may count as expired, and histories are out of order.",
        "El reloj de este ordenador va {seconds:.0f} s por detrás del último evento guardado.",
        "Ponga el reloj en hora. Hasta entonces los tokens pueden darse por vencidos y los "
        "historiales salir desordenados.",
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
        "To use the ROS nodes, start `roscore`, or set ROS_MASTER_URI.",
        "ROS está instalado, pero ningún master responde en {uri}.",
        "Para usar los nodos de ROS, inicie `roscore` o ajuste ROS_MASTER_URI.",
    ),
    "check_failed": (
        "This could not be checked ({reason}).",
        "Please report it with the log.",
        "Esto no se pudo comprobar ({reason}).",
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
