"""Spanish sentences by code."""

SENTENCES: dict[int, str] = {
    1001: "Se perdió la conexión con el controlador en {address} ({reason}). Los ejes terminan lo ya enviado. "
    "Revise cable y alimentación y conéctese de nuevo.",
    1002: "Ningún controlador responde en {address} ({reason}). Revise alimentación, cable y dirección.",
    1003: "El controlador en {address} no respondió a {command!r} en {seconds} s. Revise la red o reinicie el "
    "controlador.",
    1004: "El controlador rechazó {command!r} con el código {tc} ({reason}). Si nadie lo tecleó, compruebe qué otro programa usa este controlador.",
    1005: "El equipo en {address} es {found}; se necesita un DMC-41x3 de tres ejes. Revise la dirección.",
    1006: "El controlador respondió a {command!r} con {reply!r}, que no es válido. Compruebe que la dirección es la de un controlador Galil.",
    1008: "El programa del controlador difiere del enviado en la línea {line}: se envió {sent}, allí está {found}. Descárguelo otra vez. Si no ayuda, busque el otro programa que escribe en este controlador.",
    1009: "El controlador encontró dañado lo grabado ({what}) al encenderse por última vez. Descárguelo y grábelo otra vez antes de cualquier movimiento.",
    1010: "No hay conexión con el controlador. Espere, o revise alimentación y cable.",
    1040: "La descarga falló ({reason}) y no se pudo restaurar el programa anterior. Descargue un programa otra vez "
    "antes de ejecutarlo.",
    2110: "En el controlador se ejecuta un programa y no admite otro. Deténgalo con HX y descargue de nuevo.",
    4001: "{key} = {value} se rechaza: {reason}.",
    4003: "{name!r} no se conoce. Existen: {known}.",
    4005: "La petición se rechaza en {key}: {reason}.",
    4007: "No se puede leer {path}: {reason}.",
    4008: "{reason}. Vea `{command} --help`.",
    5002: "No se puede escribir {path}: {reason}.",
    5003: "{address} ya está en uso. Elija otro puerto o cierre el programa que escucha allí.",
    5005: "{path} es de otro usuario: {remedy}.",
    5013: "Este proceso puede abrir {limit} archivos y conexiones a la vez. Ya tiene {used} abiertos y necesita "
    "{least} más. Suba el límite con `ulimit -n 1024`, o con LimitNOFILE=1024 en una unidad de systemd.",
    5999: "Ocurrió un error interno ({reason}). Es un defecto de este programa: repórtelo con la traza.",
}
