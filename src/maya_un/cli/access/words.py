"""Texts of `maya lease` and `maya user`, in every language."""

from __future__ import annotations

_WORDS: dict[str, tuple[str, str]] = {
    "nobody": ("Nobody drives. `maya lease take` takes the lease.", "Nadie conduce. `maya lease take` toma el mando."),
    "drives": (
        "{holder} has been driving for {since} ({source}){note}.",
        "{holder} conduce desde hace {since} ({source}){note}.",
    ),
    "implicit": (
        "A command or job of {holder} is running ({source}).",
        "Una orden o un trabajo de {holder} está en curso ({source}).",
    ),
    "yours": ("That is you, here.", "Es usted, aquí."),
    "expires": ("It ends in {expires} unless it is renewed.", "Termina en {expires} si no se renueva."),
    "offered": ("It is offered to {offered_to}.", "Se ofrece a {offered_to}."),
    "asked": ("{asked_by} would like to drive.", "{asked_by} quisiera conducir."),
    "taken": ("You drive now. Ctrl-C gives the lease back.", "Ahora conduce usted. Ctrl-C devuelve el mando."),
    "taken_for": (
        "You drive for {expires}. `maya lease release` gives the lease back sooner.",
        "Conduce usted durante {expires}. `maya lease release` devuelve el mando antes.",
    ),
    "driving": ("driving for {since}", "conduciendo desde hace {since}"),
    "unheard": ("the service does not answer; it ends in {expires}", "el servicio no responde; termina en {expires}"),
    "released": ("Given back: nobody drives.", "Devuelto: nadie conduce."),
    "offering": (
        "Offered to {offered_to}, who takes it with `maya lease take` within a minute.",
        "Ofrecido a {offered_to}, que lo toma con `maya lease take` en un minuto.",
    ),
    "asking": ("Asked. {holder} sees it.", "Pedido. {holder} lo ve."),
    "asking_all": ("Asked. Nobody drives; operators see it.", "Pedido. Nadie conduce; los operadores lo ven."),
    "me": (
        "You are {name} ({role}), by token {token}, from {source}.",
        "Usted es {name} ({role}), por el token {token}, desde {source}.",
    ),
    "me_local": (
        "No users exist: you have full access on this machine ({role}). `maya user add NAME "
        "--role admin` adds the first user.",
        "No hay usuarios: usted tiene acceso completo en esta máquina ({role}). `maya user add "
        "NOMBRE --role admin` añade el primero.",
    ),
    "user": ("user", "usuario"),
    "role": ("role", "rol"),
    "since": ("since", "desde"),
    "password": ("password", "contraseña"),
    "tokens": ("tokens", "tokens"),
    "used": ("last seen", "visto"),
    "token": ("token", "token"),
    "note": ("note", "nota"),
    "until": ("until", "hasta"),
    "session": ("session", "sesión"),
    "yes": ("yes", "sí"),
    "no_users": (
        "No users exist: anyone on this machine has full access, and other machines have none.",
        "No hay usuarios: cualquiera en esta máquina tiene acceso completo, y otras máquinas ninguno.",
    ),
    "added": ("{user} is {role} now.", "{user} es ahora {role}."),
    "secret": (
        "{token}\nThis token is shown only once. It gives the access of {user}: put it into "
        "$MAYA_TOKEN, or as the only line into {file}.",
        "{token}\nEste token se muestra solo una vez. Da el acceso de {user}: póngalo en "
        "$MAYA_TOKEN, o como única línea en {file}.",
    ),
    "kept": (
        "From now on every command needs a token, except stop and abort on this machine. This "
        "token is stored in {file}, and your commands use it.",
        "Desde ahora toda orden necesita un token, salvo stop y abort en esta máquina. Este token "
        "queda en {file}, y sus órdenes lo usan.",
    ),
    "aside": (
        "The former token is in {file} now.",
        "El token anterior está ahora en {file}.",
    ),
    "other_token": (
        "${name} holds another token, which your commands use first. Unset it, or put the new token into it.",
        "${name} contiene otro token, que sus órdenes usan primero. Bórrela o ponga en ella el token nuevo.",
    ),
    "void_removed": (
        "Your token in {file} was one of them, and was removed.",
        "Su token en {file} era uno de ellos y se eliminó.",
    ),
    "changed": ("{name} is {role}.", "{name} es {role}."),
    "password_changed": (
        "The password of {name} is changed; all sessions have ended.",
        "La contraseña de {name} cambió; todas las sesiones terminaron.",
    ),
    "removed": ("{removed} is removed, with all tokens.", "{removed} fue eliminado, con todos sus tokens."),
    "revoked": ("Token {removed} is no longer valid.", "El token {removed} ya no vale."),
    "no_tokens": ("{name} has no tokens.", "{name} no tiene tokens."),
    "forgotten": (
        "All users and tokens are removed: anyone on this machine has full access again.",
        "Se eliminaron todos los usuarios y tokens: cualquiera en esta máquina tiene otra vez acceso completo.",
    ),
    "old_password": ("Password now: ", "Contraseña actual: "),
    "new_password": ("New password (at least 12 characters): ", "Nueva contraseña (al menos 12 caracteres): "),
    "again": ("Once more: ", "Otra vez: "),
}


def word(key: str, language: str, **details: object) -> str:
    """Return the words of `key` in `language`, with their details filled in."""
    english, spanish = _WORDS[key]
    return (spanish if language == "es" else english).format(**details)
