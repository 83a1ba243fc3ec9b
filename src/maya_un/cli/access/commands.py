"""The commands for the control lease and for users: their arguments and their help."""

from __future__ import annotations

from typing import Annotated, Any

import typer

from maya_un.cli.settings import settings_of
from maya_un.errors import InvalidCommandLine
from maya_un.quantities import duration
from maya_un.schema.choices import RoleName

Name = Annotated[str, typer.Argument(metavar="NAME", help="letters, digits, . _ and -")]
MaybeName = Annotated[str | None, typer.Argument(metavar="[NAME]", help="default: yourself")]
Role = Annotated[RoleName, typer.Option(help="the role of the user")]
Note = Annotated[
    str, typer.Option(metavar="TEXT", help="free text that other people see; it has no effect on the robot")
]
Held = Annotated[
    str | None, typer.Option("--for", metavar="TIME", help="duration of the lease, in s or like 10min, 8h, 30d")
]
Lasts = Annotated[
    str | None, typer.Option("--for", metavar="TIME", help="lifetime of the token, in s or like 10min, 8h, 30d")
]


def register(app: typer.Typer, how: dict[str, Any]) -> None:
    """Add the commands to `app`; `how` contains the options of all commands."""
    about = (
        "Show, take or hand over the control lease: the right to move the robot. One user has it at a time, "
        "the driver. Without a command, show the driver."
    )
    lease = typer.Typer(add_completion=False, rich_markup_mode=None, help=about)
    lease.callback(invoke_without_command=True, **how)(_driver)
    for command in (take, release, offer, ask):
        lease.command(**how)(command)
    app.add_typer(lease, name="lease")
    about = "Show the current user; manage users and roles. Without a command, show the current user."
    user = typer.Typer(add_completion=False, rich_markup_mode=None, help=about)
    user.callback(invoke_without_command=True, **how)(_me)
    for command in (add, role, password, remove, token, tokens, revoke, reset):
        user.command(**how)(command)
    user.command("list", **how)(listed)
    app.add_typer(user, name="user")


def _driver(context: typer.Context) -> int | None:
    if context.invoked_subcommand is not None:
        return None
    from maya_un.cli.access import lease

    return lease.show(settings_of(context))


def take(
    context: typer.Context,
    note: Note = "",
    force: Annotated[
        bool, typer.Option("--force", help="take the lease from another user; your role must allow it")
    ] = False,
    lasts: Held = None,
) -> int:
    """Take the control lease and hold it until Ctrl-C.

    With --for TIME the command returns at once, and you hold the lease for TIME. All your commands on this machine
    use the lease.

    Example: maya lease take --note "lesson 3" --for 45min
    """
    from maya_un.cli.access import lease

    patience = None if lasts is None else duration(lasts, "--for")
    return lease.take(note, patience, settings_of(context), force=force)


def release(context: typer.Context) -> int:
    """Give the lease back.

    Example: maya lease release
    """
    from maya_un.cli.access import lease

    return lease.release(settings_of(context))


def offer(context: typer.Context, name: Name) -> int:
    """Offer your lease to another user for one minute.

    Example: maya lease offer ana
    """
    from maya_un.cli.access import lease

    return lease.offer(name, settings_of(context))


def ask(context: typer.Context) -> int:
    """Ask the driver for the lease. All users see the request.

    Example: maya lease ask
    """
    from maya_un.cli.access import lease

    return lease.ask(settings_of(context))


def _me(context: typer.Context) -> int | None:
    if context.invoked_subcommand is not None:
        return None
    from maya_un.cli.access import users

    return users.me(settings_of(context))


def add(
    context: typer.Context,
    name: Name,
    role: Role = "student",
    password: Annotated[bool, typer.Option("--password", help="ask for a password, to sign in with")] = False,
) -> int:
    """Add a user and show a token for this user.

    Add an admin first: `maya user add NAME --role admin`.

    Example: maya user add ana --role operator
    """
    from maya_un.cli.access import users

    return users.add(name, role, settings_of(context), with_password=password)


def listed(context: typer.Context) -> int:
    """List all users.

    Example: maya user list
    """
    from maya_un.cli.access import users

    return users.listed(settings_of(context))


def role(
    context: typer.Context,
    name: Name,
    role: Annotated[
        RoleName,
        typer.Argument(metavar="ROLE", help="viewer, student, operator or admin"),
    ],
) -> int:
    """Give a user another role: viewer, student, operator or admin.

    Example: maya user role ana student
    """
    from maya_un.cli.access import users

    return users.change_role(name, role, settings_of(context))


def password(
    context: typer.Context,
    name: MaybeName = None,
    none: Annotated[bool, typer.Option("--none", help="remove the password")] = False,
) -> int:
    """Change the password of a user. All web sessions of this user end.

    Example: maya user password ana
    """
    from maya_un.cli.access import users

    return users.change_password(name, settings_of(context), none=none)


def remove(context: typer.Context, name: Name) -> int:
    """Remove a user with all tokens.

    Example: maya user remove ana
    """
    from maya_un.cli.access import users

    return users.remove(name, settings_of(context))


def token(
    context: typer.Context,
    name: MaybeName = None,
    note: Note = "",
    expires: Annotated[str, typer.Option(metavar="DATE", help="in UTC: 2027-01-31 or 2027-01-31T12:00:00Z")] = "",
    lasts: Lasts = None,
) -> int:
    """Make one more token and show it.

    Example: maya user token ana --note phone --expires 30d
    """
    from maya_un.cli.access import users

    return users.make_token(
        name, note, expires, None if lasts is None else duration(lasts, "--for"), settings_of(context)
    )


def tokens(context: typer.Context, name: MaybeName = None) -> int:
    """List tokens, never their secrets.

    It shows their notes, dates and last use.

    Example: maya user tokens ana
    """
    from maya_un.cli.access import users

    return users.tokens(name, settings_of(context))


def revoke(
    context: typer.Context,
    token: Annotated[str, typer.Argument(metavar="TOKEN", help="its id, or the whole token")],
) -> int:
    """Make a token invalid at once.

    Example: maya user revoke 3f9a
    """
    from maya_un.cli.access import users

    return users.revoke(token, settings_of(context))


def reset(
    context: typer.Context,
    name: Annotated[str | None, typer.Argument(metavar="[NAME]", help="make this user an admin")] = None,
    forget: Annotated[bool, typer.Option("--all", help="remove all users and tokens")] = False,
    journal: Annotated[
        str | None,
        typer.Option(
            metavar="FILE", help="file that stores the queue  [default: maya.db in the state folder of this user]"
        ),
    ] = None,
) -> int:
    """Restore access if the admin has lost the token.

    Run it on the robot's computer while `maya up` does not run.

    Example: maya user reset ana
    """
    from maya_un.cli.access import users

    if (name is None) is not forget:
        raise InvalidCommandLine(reason="give either NAME or --all", command="maya user reset")
    settings = settings_of(context)
    return users.forget(journal, settings) if name is None else users.reset(name, journal, settings)
