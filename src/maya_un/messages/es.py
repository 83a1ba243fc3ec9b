"""Spanish sentences by code."""

SENTENCES: dict[int, str] = {
    1001: "Se perdió la conexión con el controlador en {address} ({reason}). Los ejes terminan el movimiento ya enviado. Revise cable y alimentación y ejecute `maya recover`.",
    1002: "Ningún controlador responde en {address} ({reason}). Revise alimentación, cable y dirección, o inicie un gemelo "
    "con `maya dmc serve`.",
    1004: "El controlador rechazó {command!r} con el código {tc} ({reason}). Si nadie lo tecleó, es un defecto o un programa ajeno en el controlador: lea el registro.",
    1005: "El equipo en {address} es {found}; Maya necesita un DMC-41x3 de tres ejes. Revise la dirección.",
    1007: "El controlador guarda {register} = {found}, pero la configuración dice {wanted}. Corrija uno de los dos.",
    1011: "{node} ya no está en marcha. Su movimiento se detuvo sobre la trayectoria. Inícielo de nuevo y compruebe la posición del robot antes de seguir.",
    1020: "Ningún Maya está en marcha aquí. Inicie `maya up` y repita la orden. Para detener un robot sin `maya up`, ejecute `maya stop --address real` (o HOST:PORT).",
    1021: "El `maya up` en marcha no responde ({reason}). Detenga el robot con `maya stop` y reinícielo.",
    1022: "Maya no sabe qué controlador virtual usar: {reason}. Inicie `maya dmc serve`, o elija con `--twin` uno que esté en marcha (ahora: {running}).",
    1030: "Otro programa en marcha, {holder}, es el dueño del controlador en {address}. Use ese programa o termínelo. "
    "Si no puede, compruebe que el robot esté en reposo y tome el controlador con `--take-over`.",
    1031: "Otro programa, {holder}, tomó el controlador. Este programa ya no mueve nada y conserva sus trabajos en "
    "espera. Use el otro programa. Cuando haya terminado, ejecute aquí `maya recover` y luego `maya queue resume`.",
    1032: "Aún se mueven ejes por órdenes de {holder}, así que el controlador no puede cambiar de dueño ahora. Espere "
    "a que estén en reposo, o deténgalos desde cualquier computador con `maya stop --address {address}`. Luego "
    "inténtelo otra vez.",
    1033: "Otro programa borró la variable que nombra al dueño del controlador (ZAB), así que nada se mueve. Cierre el "
    "otro programa y luego ejecute `maya recover`.",
    1050: "El rosbridge del robot en {url} no responde: {reason}. Arranque el robot con `maya up --rosbridge`, o ponga su dirección en IP. Este programa lo intentará otra vez.",
    1051: "El servidor de los supervisores {where} no responde: {reason}. Compruebe que funciona, y su dirección, usuario y contraseña.",
    1052: "El broker {where} rechaza la orden: {reason}. Pida acceso a este robot a quien lleva sus reglas (ACL).",
    1053: "Otro robot está conectado a {where} con el nombre {name}, así que este robot no se vuelve a conectar. Dé a cada robot su propio nombre (coms.name, NAME) y arranque este programa otra vez.",
    1054: "El rosbridge de {url} es del robot {found!r}, y este programa lleva las órdenes de {name}. No envía ninguna allí. Dele la dirección del rosbridge de {name} (IP, --rosbridge), o dé a este programa y al robot el mismo nombre (coms.name, NAME).",
    2101: "{target} no se puede alcanzar: {reason}. Lo más cercano alcanzable: {nearest}.",
    2102: "El camino a {target} sale del espacio de trabajo: {reason}. Vaya por un punto intermedio.",
    2103: "El robot no ha hecho el homing, así que no se conoce su posición. Ejecute primero `maya home`.",
    2104: "El robot está ocupado ({doing}). Espere a que termine o ejecute `maya stop`.",
    2105: "El robot está en fallo: {fault} Elimine la causa y ejecute `maya recover`.",
    2106: "No se puede omitir el homing, porque el controlador no guarda la marca de uno desde su último reinicio. Ejecute `maya home`.",
    2107: "Esta trayectoria se rechaza: {reason}.",
    2108: "No hay ningún fallo del que recuperarse.",
    2109: "El guardián no se puede añadir al programa del controlador: {reason}.",
    2110: "En el controlador se ejecuta un programa, así que no se puede descargar otro. Si es el guardián de Maya, termine `maya up`; detenga los demás con HX. Luego descargue de nuevo.",
    2111: "Esto no se puede pausar: {reason}. Si algo no debe moverse, ejecute `maya stop`.",
    2112: "Nada está en pausa. Un movimiento detenido no se puede reanudar: inícielo de nuevo.",
    2201: "Detenido antes del final por una orden de parada.",
    2202: "Cancelado antes del final.",
    2301: "El eje {axis} tocó su final de carrera {side}. Busque la causa; luego ejecute `maya recover` y haga homing otra vez.",
    2302: "El eje {axis} no pudo seguir su referencia y su motor se apagó. Busque un obstáculo o un cable atascado y ejecute `maya recover`.",
    2303: "La entrada de aborto está activa: alguien pulsó la parada de emergencia. Suéltela y ejecute `maya recover`.",
    2304: "El amplificador informa de un fallo (estado {status}). Revise sus luces y la fuente y ejecute `maya recover`.",
    2305: "El eje {axis} paró con el código {stop_code} ({reason}) sin ninguna orden. Revise la máquina y ejecute `maya recover`.",
    2306: "El motor del eje {axis} está apagado. Revise la máquina y ejecute `maya recover`.",
    2307: "El controlador se reinició y se perdió la posición. Ejecute `maya recover` y luego `maya home`.",
    2308: "El eje {axis} paró a {distance} de su destino. Revise la máquina y ejecute `maya recover`.",
    2309: "El guardián del controlador ya no funciona, así que nada se mueve: otro programa envió HX, ST o AB, o el controlador se reinició. Ejecute `maya recover`.",
    2310: "El guardián del controlador detuvo los ejes, porque este programa estuvo callado demasiado tiempo. Averigüe por qué este ordenador está sobrecargado y ejecute `maya recover`.",
    2311: "El eje {axis} está a {distance} de donde Maya lo dejó. Otro programa lo movió o cambió su posición (DP), o "
    "alguien lo empujó. El homing ya no vale. Cierre el otro programa, si lo hay, y suelte el eje. Ejecute `maya "
    "recover` y haga homing otra vez.",
    2312: "El registro {register} del controlador vale {found}, pero Maya espera {wanted}. Otro programa lo cambió. El "
    "movimiento solo es seguro con {register} = {wanted}. Cierre ese programa y ejecute `maya recover`, que vuelve a "
    "escribir {wanted}.",
    2313: "El eje {axis} se mueve, pero Maya no inició este movimiento. Maya lo detiene y el homing ya no vale. Cierre "
    "todo otro programa que mande en el controlador y suelte el eje. Ejecute `maya recover` y haga homing otra vez.",
    2314: "Maya no puede conservar el homing: el eje {axis} está a {distance} de donde Maya lo dejó. Otro programa lo "
    "movió o cambió su posición, o alguien lo empujó. Ejecute `maya home`.",
    2315: "El eje {axis} no puede empezar a moverse. Su final de carrera {side} lee activo, aunque el eje no está al "
    "final de su carrera. Revise el interruptor y su cable y ejecute `maya recover`.",
    2401: "El final de carrera {side} del eje {axis} lee lo contrario de CN {cn} ({reason}). Corrija el cableado, o `limit_active_level` en la configuración.",
    2402: "El eje {axis} dejó de seguir durante el homing ({reason}). Busque un obstáculo y ejecute `maya recover`.",
    2403: "El eje {axis} recorrió {distance} sin encontrar el final de carrera {side}. Revise el interruptor y su cable.",
    2404: "La carrera del eje {axis} mide {measured}, pero la configuración dice {wanted}. Revise la línea y la configuración.",
    3001: "La pinza está cerrada y no puede recoger. Deje la pieza o abra antes la pinza.",
    3002: "La pinza está abierta y no hay nada que dejar. Recoja antes una pieza.",
    4002: "El trabajo se rechaza en {key}: {reason}.",
    4004: "No existe {what} {number}.",
    4006: "`--speed` escala el tiempo del gemelo, pero {address} es una máquina real. Quítelo.",
    4009: "Estos puntos no determinan {what}: {reason}. Para determinarlos, {remedy}.",
    4010: "No se ha enseñado {what} con el nombre {name!r}. Existen: {known}. `maya teach` guarda la posición actual con un nombre.",
    4011: "{name!r} ya está enseñado. Elija otro nombre, o reemplácelo con `--replace`.",
    4012: "La clave de idempotencia {key!r} ya se usó para otra petición. Use una clave nueva para una petición nueva.",
    4013: "Se pidieron eventos posteriores al {since}, pero el más antiguo guardado es el {oldest}. Lea el estado otra vez y siga desde ahí.",
    4014: "El trabajo {number} está {state}, así que no se puede: {wish}.",
    4015: "Solo una persona puede responder a esto: {question} Responda con `maya queue recover ELECCIÓN` ({options}).",
    4016: "Va {behind} eventos por detrás en esta conexión y por eso se cerró. Conecte otra vez, siga desde el evento {since} y lea más deprisa.",
    4017: "El trabajo {number}, del que depende este, está {state}. Libere este para hacerlo de todos modos, o cancélelo.",
    4018: "No se puede leer {name}: {reason}.",
    4019: "No hay {form} llamado {name}.",
    4020: "El servicio {service} falló: {reason}.",
    4022: "El trabajo {number} cambió después de que usted lo mirara. Mírelo otra vez: `maya job show {number}`.",
    4021: "El grafo de ROS no tiene mensaje para esto: {wish}. Use `maya` junto a la capa del robot, o `maya up`.",
    4030: "Hay demasiados cálculos a la vez (como máximo {most}). Espere a que termine uno e inténtelo otra vez.",
    4031: "Esta petición necesita más de {seconds} s de cálculo. Redúzcala: menos pasos, menos muestras, menos zonas.",
    4032: "Esta petición necesita más de {most}. Redúzcala: menos pasos o menos muestras.",
    4040: "El plazo de este paso, {deadline}, ha pasado. Envíelo otra vez con un plazo posterior si todavía hace falta.",
    4041: "Este paso es para el robot {robot}, y este robot es {name}. Envíelo a {robot}.",
    4042: "El robot se detuvo, o falló el paso anterior, y este paso no empezó. Mire el robot y envíe el paso otra vez con otro id.",
    4043: "El paso {id} de {robot} se interrumpió: su programa terminó. Mire el robot y decida si envía el paso otra vez con otro id.",
    4044: "El paso {id} de {robot} falló: {error} ({code}).",
    4045: "El proceso se rechaza en {key}: {reason}.",
    4046: "{path} guarda el estado de otro proceso, porque el archivo del proceso ha cambiado. Restaure el archivo anterior para continuar, o empiece de nuevo con --again.",
    4047: "El paso {step} de {robot} falló ({code}): {error} Mire el robot y ejecute el proceso otra vez con --retry {step}, --skip {step} o --abort.",
    4048: "El proceso se abortó: se hicieron {done} de {steps} pasos. Empiece de nuevo con --again.",
    4049: "Otro robot con el nombre {name} tomó este paso antes, o este robot lo tomó y después perdió su diario. Este robot no lo ejecuta, y su progreso no se conoce. Mire los robots. Si el paso aún hace falta, envíelo otra vez con otro id.",
    4101: "Esto necesita un token válido: {reason}. Pida uno a un administrador del robot (`maya user token`).",
    4102: "{who} es {role}, pero {operation} necesita {needed}. Pídalo a alguien con ese rol.",
    4103: "{holder} conduce el robot desde {since}. Pida el mando con `maya lease ask`, o espere. `maya stop` vale para todos.",
    4104: "Esta orden necesita el mando. Tómelo con `maya lease take`.",
    4105: "Este mando ha terminado ({reason}). Tómelo de nuevo con `maya lease take`.",
    4106: "Demasiadas peticiones (se permiten {limit} en {seconds} s). Espere {wait} s.",
    4110: "Se rechazó el certificado del servicio ({reason}). Use la URL que mostró `maya up` e indique el archivo con "
    "el certificado del servicio como `ca`. `maya doctor` comprueba el nombre y las fechas del certificado.",
    5001: "La configuración se rechaza en {key} = {value}: {reason}.",
    5004: "`maya up`, o los nodos de ROS, ya están en marcha (proceso {pid}). Úselos o ciérrelos antes.",
    5006: "No hay calibración que deshacer en {path}: {reason}.",
    5007: "El disco no aceptó guardar esto ({reason}), así que Maya no aceptó nada de ello. Libere espacio en el disco o corrija sus permisos e inténtelo otra vez.",
    5008: "{path} está dañado ({reason}) y no se cambió. Restaure una copia (`maya queue restore`), o aparte el archivo para empezar con uno vacío.",
    5009: "{path} lo escribió una versión más nueva ({found}; esta conoce {known}). Use esa versión, u otro archivo.",
    5010: "{path} lo usa el proceso {pid}. Ciérrelo antes, o use otro archivo.",
    5011: "Ningún maestro de ROS responde en {uri}. Inicie `roscore`, o roslaunch, que inicia uno. ROS_MASTER_URI contiene su dirección.",
    5012: "Desde aquí no se puede usar ROS ({reason}). En Debian y Ubuntu, `scripts/ros` instala todo lo necesario.",
    5014: "{path} no se puede abrir para escribir ahora ({reason}), así que no se inició nada. Libere espacio en el "
    "disco, o móntelo para escritura, e inicie de nuevo. systemd lo intenta otra vez por sí mismo.",
    5020: "El proceso auxiliar falló ({reason}), así que no hay resultado. Nada se ha movido. Inténtelo otra vez. Si "
    "vuelve a fallar, lea el registro y reinicie `maya up`.",
    5999: "Ocurrió un error interno ({reason}). Es un defecto de este programa: repórtelo con el registro.",
}

_STATES = {
    "queued": "en cola",
    "held": "retenido",
    "running": "en marcha",
    "paused": "en pausa",
    "interrupted": "interrumpido",
    "done": "hecho",
    "failed": "fallido",
    "cancelled": "cancelado",
    "skipped": "omitido",
}

WORDS: dict[int, dict[str, dict[str, str]]] = {
    4004: {
        "what": {
            "job": "el trabajo",
            "interrupted job": "un trabajo interrumpido",
            "recording": "la grabación",
            "token": "el token",
            "zone": "la zona",
            "twin": "un gemelo",
            "journal": "un diario",
        },
        "number": {
            "that was interrupted": "que se interrumpió",
            "now": "ahora",
            "on a real machine": "en una máquina real",
            "in a file": "en un archivo",
        },
    },
    4014: {
        "state": _STATES,
        "wish": {
            "held": "retenerlo",
            "released": "liberarlo",
            "moved": "moverlo",
            "a neighbour": "ponerle otro al lado",
            "changed": "cambiarlo",
            "done again": "hacerlo de nuevo",
        },
    },
    4015: {
        "question": {
            "is a part in the gripper?": "¿hay una pieza en la pinza?",
            "what becomes of the job that was interrupted?": "¿qué se hace con el trabajo que se interrumpió?",
        },
        "options": {
            "holding: true or false; `--holding yes` or `no`": "holding: true o false; `--holding yes` o `no`",
        },
    },
    4017: {"state": _STATES},
}
"""Translations of details, by code and name of the detail."""
