"""Arguments and options that commands share; each has one name, meaning and type."""

from collections.abc import Callable
from pathlib import Path
from typing import Annotated

import typer

from ccmodel import paths
from ccmodel.cli import completion


def _each(callback: Callable) -> Callable:
    """A callback of one value as that of a list of them."""

    def of_all(ctx: typer.Context, param: typer.CallbackParam, values: list[Path]) -> list[Path]:
        return [callback(ctx, param, value) for value in values]

    return of_all


def _checked(check: Callable[..., Path], *, says: bool = False) -> Callable:
    """A check of `ccmodel.paths` as the callback of an option; with `says`, its message names the option."""

    def callback(ctx: typer.Context, param: typer.CallbackParam, value: Path | None) -> Path | None:
        if value is None or ctx.resilient_parsing:
            return value
        return check(value, param.opts[0]) if says else check(value)

    return callback


batch_folder, input_folder, input_file = map(_checked, (paths.batch_folder, paths.existing_folder, paths.existing_file))
new_folder, new_batch, new_file = (
    _checked(check, says=True) for check in (paths.try_folder, paths.try_batch_folder, paths.try_file)
)

_BATCH = {"callback": batch_folder, "autocompletion": completion.batch_folders, "show_default": False}

Batch = Annotated[Path, typer.Argument(metavar="BATCH", help="Folder of a batch, or its batch.yaml.", **_BATCH)]
Batches = Annotated[
    list[Path],
    typer.Argument(
        metavar="BATCH",
        help="Folder of a batch, or its batch.yaml; or those of all batches of one rig, to diagnose them together.",
        **(_BATCH | {"callback": _each(batch_folder)}),
    ),
]
BatchOption = Annotated[Path | None, typer.Option("--batch", help="Folder of a batch, or its batch.yaml.", **_BATCH)]
Model = Annotated[
    Path,
    typer.Option(
        "--model", help="A model file, as a diagnosis or a fit writes it.", callback=input_file, show_default=False
    ),
]
ConduitsOf = Annotated[
    str | None,
    typer.Option(
        help="Recording whose conduits are used; else the first that the model was fitted to.", show_default=False
    ),
]
Pretension = Annotated[
    float | None, typer.Option(min=0.0, help="Pretension, N; else that recording's.", show_default=False)
]
Results = Annotated[
    Path, typer.Argument(metavar="RESULTS", help="Folder of a run's results, or of a diagnosis.", callback=input_folder)
]
RunResults = Annotated[
    Path, typer.Argument(metavar="RESULTS", help="Folder of a run's results.", callback=input_folder)
]
Cores = Annotated[int, typer.Option("--cores", min=1, help="Number of processes.")]
Tolerance = Annotated[
    list[str],
    typer.Option(
        "--tolerance",
        help="Tolerance as a SHARE of peak to peak, or by channel as tau_in_Nm=0.02, repeated.",
        show_default=False,
    ),
]
Step = Annotated[
    float | None, typer.Option("--step", min=1e-4, help="Time between compared samples, s.", show_default=False)
]
Cycles = Annotated[
    int | None, typer.Option("--cycles", min=1, help="Number of compared cycles of a sine.", show_default=False)
]
TrustInputs = Annotated[bool, typer.Option("--trust-inputs", help="Go on even if the inputs contradict one another.")]
Json = Annotated[bool, typer.Option("--json", help="Print one JSON document; errors too.")]
Quiet = Annotated[bool, typer.Option("--quiet", help="Print the result alone: no progress, hints or warnings.")]


def out_folder(text: str) -> typer.models.OptionInfo:
    """`--out` of a command that writes a folder."""
    return typer.Option("--out", help=text, callback=new_folder, show_default=False)


def out_batch(text: str) -> typer.models.OptionInfo:
    """`--out` of a command that writes the folder of a batch, or adds to it."""
    return typer.Option("--out", help=text, callback=new_batch, show_default=False)


def out_file(text: str) -> typer.models.OptionInfo:
    """`--out` of a command that writes a file."""
    return typer.Option("--out", help=text, callback=new_file, show_default=False)


def tolerance_of(stated: list[str]) -> float | dict[str, float] | None:
    """One tolerance for all channels, or one for each channel, from the words of the command line.

    Raises
    ------
    InputError
        If they are not shares, or one of several has no channel.
    """
    from ccmodel.typed import InputError

    try:
        shares = {channel: float(share) for channel, _, share in (one.rpartition("=") for one in stated)}
    except ValueError:
        raise InputError(f"--tolerance: a share is a number, as 0.02; got {', '.join(stated)}") from None
    if len(shares) < len(stated):
        raise InputError(f"--tolerance: got {', '.join(stated)}: one share for a channel")
    if "" not in shares:
        return shares or None
    if len(stated) > 1:
        raise InputError(f"--tolerance: got {', '.join(stated)}: a share without a channel is that of all")
    return shares[""]
