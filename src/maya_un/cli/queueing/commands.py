"""The commands for the queue: their arguments and their help."""

from __future__ import annotations

from typing import Annotated, Any, Literal

import typer

from maya_un.cli.settings import settings_of
from maya_un.schema.choices import MOST_PRIORITY, MOST_RETRIES, OnFailure, QueueEnd, RecoveryChoice


def _priority(default: str) -> Any:
    text = f"priority; jobs with greater numbers run first  [default: {default}]"
    return typer.Option("--priority", metavar="N", min=-MOST_PRIORITY, max=MOST_PRIORITY, help=text)


def _on_failure(default: str) -> Any:
    text = f"if the job fails: continue with the next job, or pause the queue  [default: {default}]"
    return typer.Option("--on-failure", help=text)


def _retries(default: str) -> Any:
    text = f"how often to repeat a failed step that is safe to repeat  [default: {default}]"
    return typer.Option("--retries", metavar="N", min=0, max=MOST_RETRIES, help=text)


Number = Annotated[int, typer.Argument(metavar="JOB", min=1, help="number of the job (see `maya queue`)")]
Other = Annotated[
    int | None, typer.Argument(metavar="[OTHER]", min=1, help="number of the other job; only with before and after")
]
JobFile = Annotated[str, typer.Argument(metavar="FILE", help="a YAML or JSON file")]
Priority = Annotated[int | None, _priority("0")]
NewPriority = Annotated[int | None, _priority("unchanged")]
After = Annotated[
    list[int] | None, typer.Option("--after", metavar="JOB", help="begin only after this job is done; may be repeated")
]
Notes = Annotated[
    str | None, typer.Option(metavar="TEXT", help="free text that other people see; it has no effect on the robot")
]
FailureAction = Annotated[OnFailure | None, _on_failure("continue")]
NewFailureAction = Annotated[OnFailure | None, _on_failure("unchanged")]
Retries = Annotated[int | None, _retries("0")]
NewRetries = Annotated[int | None, _retries("unchanged")]
Stepwise = Annotated[bool | None, typer.Option(help="pause after every step")]
Holding = Annotated[
    Literal["yes", "no"] | None,
    typer.Option(help="yes or no: whether the gripper holds a part; needed where Maya asks for it"),
]


def register(app: typer.Typer, how: dict[str, Any]) -> None:
    """Add the commands to `app`; `how` contains the options of all commands."""
    about = "Show and change the queue of jobs. Without a command, show it."
    queue = typer.Typer(add_completion=False, rich_markup_mode=None, help=about)
    queue.callback(invoke_without_command=True, **how)(_shown)
    for command in (pause, resume, step, answer, clear, move, recover, backup, restore, export):
        queue.command(**how)(command)
    about = "One job, from its submission to its end."
    job = typer.Typer(add_completion=False, rich_markup_mode=None, epilog=how["epilog"], help=about)
    for command in (submit, show, cancel, hold, release, again, edit, notes):
        job.command(**how)(command)
    app.add_typer(queue, name="queue")
    app.add_typer(job, name="job")
    app.command(**how)(history)


def _shown(context: typer.Context) -> int | None:
    if context.invoked_subcommand is not None:
        return None
    from maya_un.cli.queueing import queue

    return queue.show(settings_of(context))


def pause(
    context: typer.Context,
    now: Annotated[
        bool, typer.Option("--now", help="pause the current step at once too; the robot decelerates along the path")
    ] = False,
) -> int:
    """Pause the queue after the current step.

    Example: maya queue pause --now
    """
    from maya_un.cli.queueing import queue

    return queue.pause(settings_of(context), now=now)


def resume(context: typer.Context) -> int:
    """Continue the queue, and the step that `queue pause --now` paused.

    Example: maya queue resume
    """
    from maya_un.cli.queueing import queue

    return queue.resume(settings_of(context))


def step(context: typer.Context) -> int:
    """Do one step, then pause.

    Example: maya queue step
    """
    from maya_un.cli.queueing import queue

    return queue.step(settings_of(context))


def answer(
    context: typer.Context,
    choice: Annotated[
        str | None,
        typer.Argument(metavar="[CHOICE]", help="one of the choices; without it the command asks, on a terminal"),
    ] = None,
) -> int:
    """Answer the question of the running job.

    A question without its own choices takes `continue` or `cancel`; `cancel` ends the job.

    Example: maya queue answer continue
    """
    from maya_un.cli.queueing import queue

    return queue.answer(choice, settings_of(context))


def clear(context: typer.Context) -> int:
    """Cancel all waiting jobs; the running job continues.

    Example: maya queue clear
    """
    from maya_un.cli.queueing import queue

    return queue.clear(settings_of(context))


def move(
    context: typer.Context,
    job: Number,
    where: Annotated[
        Literal[QueueEnd, "before", "after"],
        typer.Argument(help="first or last: of all waiting jobs; before or after: of the other job"),
    ],
    other: Other = None,
) -> int:
    """Move a waiting job within the queue.

    Example: maya queue move 7 first
    """
    from maya_un.cli.queueing import queue

    return queue.move(job, where, other, settings_of(context))


def recover(
    context: typer.Context,
    choice: Annotated[
        RecoveryChoice | None,
        typer.Argument(help="one of the four; without it the command asks, on a terminal"),
    ] = None,
    holding: Holding = None,
    pause: Annotated[bool, typer.Option("--pause", help="leave the queue paused")] = False,
) -> int:
    """Decide about an interrupted job.

    The job was running when `maya up` ended. Nothing moves until you choose.

    resume: repeat the interrupted step, or count it as done if the gripper shows that it was done. redo: repeat the
    step. skip: omit the step. abort: end the job.

    Example: maya queue recover resume --holding yes
    """
    from maya_un.cli.queueing import recovery

    holds = None if holding is None else holding == "yes"
    return recovery.recover(choice, holds, settings_of(context), pause=pause)


def backup(context: typer.Context, file: Annotated[str, typer.Argument(metavar="FILE", help="file to write")]) -> int:
    """Copy the queue and the history of jobs to FILE. `maya up` may run.

    Example: maya queue backup queue.backup
    """
    from maya_un.cli.queueing import storage

    return storage.backup(file, settings_of(context))


def restore(context: typer.Context, file: Annotated[str, typer.Argument(metavar="FILE", help="a backup")]) -> int:
    """Replace the queue and its history by a backup.

    End `maya up` first. The command renames the old file and prints its new name.

    Example: maya queue restore queue.backup
    """
    from maya_un.cli.queueing import storage

    return storage.restore(file, settings_of(context))


def export(
    context: typer.Context,
    file: Annotated[str, typer.Argument(metavar="FILE", help="file to write: NAME.csv or NAME.jsonl")],
) -> int:
    """Write all stored jobs to FILE.

    NAME.csv: a table. NAME.jsonl: one line of JSON for each job, with all steps.

    Example: maya queue export jobs.jsonl
    """
    from maya_un.cli.queueing import storage

    return storage.export(file, settings_of(context))


def submit(  # noqa: PLR0913, PLR0917 - every option of a command is a parameter
    context: typer.Context,
    file: JobFile,
    priority: Priority = None,
    held: Annotated[bool, typer.Option("--held", help="hold the job until a person releases it")] = False,
    after: After = None,
    notes: Notes = None,
    on_failure: FailureAction = None,
    retries: Retries = None,
    stepwise: Stepwise = None,
    wait: Annotated[bool, typer.Option("--wait", help="follow the job to its end; Ctrl-C cancels it")] = False,
) -> int:
    """Append a job to the queue of the running robot.

    Example: maya job submit sort.yaml --priority 5 --wait
    """
    from maya_un.cli.queueing import jobs

    depends_on = None if after is None else tuple(after)
    options = jobs.QueueingOptions(priority, held or None, depends_on, notes, on_failure, retries, stepwise)
    return jobs.submit(file, options, settings_of(context), wait=wait)


def show(context: typer.Context, job: Number) -> int:
    """Show the details of a job, step by step.

    It also shows jobs that ended long ago.

    Example: maya job show 7
    """
    from maya_un.cli.queueing import jobs

    return jobs.show(job, settings_of(context))


def cancel(context: typer.Context, job: Number) -> int:
    """End a job early, or decline a proposal.

    A running job stops: the robot decelerates along the path.

    Example: maya job cancel 7
    """
    from maya_un.cli.queueing import jobs

    return jobs.cancel(job, settings_of(context))


def hold(context: typer.Context, job: Number) -> int:
    """Keep a waiting job from starting until `maya job release`.

    Example: maya job hold 7
    """
    from maya_un.cli.queueing import jobs

    return jobs.hold(job, settings_of(context))


def release(
    context: typer.Context,
    job: Number,
    version: Annotated[
        str | None,
        typer.Option(
            metavar="VERSION",
            help="approve the proposal only if it still has this version, as `maya job show` prints it",
        ),
    ] = None,
) -> int:
    """Release a held job, so that it waits for its turn.

    If it is a proposal (a student's job), this approves it and shows it.

    Example: maya job release 7
    """
    from maya_un.cli.queueing import jobs

    return jobs.release(job, version, settings_of(context))


def again(
    context: typer.Context,
    job: Number,
    from_step: Annotated[
        int | None,
        typer.Option(
            "--from",
            metavar="STEP",
            min=1,
            help="number of the step to begin with  [default: the first unfinished step]",
        ),
    ] = None,
) -> int:
    """Append a copy of an ended job to the queue, as a new job.

    Example: maya job again 7 --from 3
    """
    from maya_un.cli.queueing import jobs

    return jobs.again(job, from_step, settings_of(context))


def edit(  # noqa: PLR0913, PLR0917 - every option of a command is a parameter
    context: typer.Context,
    job: Number,
    file: Annotated[
        str | None, typer.Option("--file", metavar="FILE", help="replace the steps of the job by those of this file")
    ] = None,
    priority: NewPriority = None,
    after: After = None,
    notes: Notes = None,
    on_failure: NewFailureAction = None,
    retries: NewRetries = None,
    stepwise: Stepwise = None,
) -> int:
    """Change a waiting job, or the remaining steps of a paused job.

    Without options the command opens the job in
    $EDITOR.

    Example: maya job edit 7 --priority 5
    """
    from maya_un.cli.queueing import jobs

    depends_on = None if after is None else tuple(after)
    options = jobs.QueueingOptions(priority, None, depends_on, notes, on_failure, retries, stepwise)
    return jobs.edit(job, options, file, settings_of(context))


def notes(
    context: typer.Context,
    job: Number,
    text: Annotated[
        str, typer.Argument(metavar="TEXT", help="free text that other people see; it has no effect on the robot")
    ],
) -> int:
    """Change the notes of a waiting job.

    Example: maya job notes 7 "for the demonstration"
    """
    from maya_un.cli.queueing import jobs

    return jobs.notes(job, text, settings_of(context))


def history(
    context: typer.Context,
    count: Annotated[
        int, typer.Argument(metavar="[N]", min=1, max=100_000, help="number of jobs to list, newest first")
    ] = 20,
    owner: Annotated[str | None, typer.Option(metavar="NAME", help="list only jobs of this owner")] = None,
    state: Annotated[
        list[str] | None,
        typer.Option(metavar="STATE", help="queued, held, running, paused, interrupted, done, failed or cancelled"),
    ] = None,
    text: Annotated[
        str | None, typer.Option(metavar="WORDS", help="list only jobs whose name or notes contain WORDS")
    ] = None,
    as_csv: Annotated[bool, typer.Option("--csv", help="as CSV, dates in UTC, durations in s")] = False,
) -> int:
    """List past jobs: owner, origin, predicted and actual times.

    Example: maya history 20 --state failed
    """
    from maya_un.cli.queueing import history as command

    return command.history(command.HistoryFilter(count, owner, state or (), text), settings_of(context), as_csv=as_csv)
