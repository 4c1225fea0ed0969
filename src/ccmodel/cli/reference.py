"""The page ``docs/command-line.md``: conventions, and each command with its arguments and options."""

import re
from typing import Any

import typer
from typer.cli import get_docs_for_click

# Rows of a table are long lines.
# ruff: noqa: E501
HEAD = """\
# Command line

The part from [Commands](#commands) on is made from the help of the commands: `ccmodel reference > docs/command-line.md`
writes this page again.

## Conventions

- A batch is named by its folder or by its `batch.yaml`.
- An option has the same name, meaning and type in every command. `--out` is what a command writes: a folder, or a file
  for a command that writes a single one. It is tried before the work begins, and a command that cannot write it ends
  at once. `--model` is a model file, as `diagnose` and `fit` write it. `--cores` is a number of processes.
- A former name of an option or command still works; a message gives the present one.
- A misspelt command, option, mechanism, folder or file is answered with the nearest one that there is.
- `ccmodel COMMAND --help` has an example of each command, `ccmodel --version` prints the version.

## What is printed where

Results go to standard output; messages, findings and progress go to standard error. A command that lasts shows a bar
with the elapsed time and an estimate of the remaining time on a terminal. In a pipe or a file there is no bar and no
colour, and each row of a table is one line, whatever its width. The estimate knows the shares of the stages on the
batches of this repository; on a machine that has never run the model, the first command also compiles it, which takes
about a minute and is not foreseen. The jobs of the pipeline write the same lines into `results/logs`.

`--quiet` leaves out progress, hints and warnings.

`--json` prints one JSON document on standard output and nothing else there. A number that is not finite is `null`. An
error is `{"error": [...]}`, a line for each problem, with the exit code that it has without `--json`:

```sh
ccmodel check data/raw/loops --json | jq '.findings[].text'
ccmodel diagnose data/raw/loops --out out --json | jq '.verdict'
```

## Keys of the JSON documents

Keys are added in later versions, and never renamed or removed. A key has its unit at its end (`stroke_rad`), or the
unit is a value beside it (`unit`). A value that there is not is `null`. `out` is what the command has written.

| command | keys |
|---|---|
| `init` | `batch_file`; `fill_in`: a list of `line` and `text`; `refused`: why a log is left out, by its name |
| `import` | without a map `map`, `files` (by file a list of `column`, `signal`, `unit`, `sign`, `sure`, `why`), `missing`, `remarks`; with one `folder`, `recordings` (by id `samples`, `columns`, `remarks`), `left_out`, `batch_file_drafted`, `not_listed` (ids that an earlier `batch.yaml` lacks) |
| `check` | `usable`; `recordings`: by id `samples`, `rate_Hz`, `duration_s`, `rest_s`, `stroke_rad`, `frequency_Hz`, `cycles`, `wave`, and `channels`, a list of `name`, `low`, `high`, `noise`, `step`, `unit`; `findings`: a list of `batch`, `file`, `row`, `column`, `severity` ("warning", "refused" or "inconsistent"), `text`, `confidence`, `contradicts`, and `line`, where and what in one line |
| `fit` | the model file: `format`, `parameters` (by name, which ends with the unit), `mechanisms`, `rig`, `intervals` (90 %, by parameter `low`, `high`, `sd`), `provenance`; `fit`: `succeeded`, `message`, `mean_square`, `recordings`, `at_bound`; `out`, `warnings`, `notes`, `left_out` |
| `simulate` | `out`, `recording`, `samples`, `pretension_N` |
| `predict` | `out`; `errors`: a list with a row for each recording and channel, as in the table of errors of a run; `findings`, `notes`, `left_out` |
| `estimate` | `out`; `errors`: a list with a row for each recording and load sensor: `recording`, `channel`, `unit`, `bias`, `rms`, `share_within` (of the 90 % interval), `samples`; `visible_share`: by recording; `notes`, `left_out` |
| `compensate` | `out`, `samples`; root mean square error of the load's angle by the model: `lost_motion_rad` with this motion of the drive, `straight_lost_motion_rad` if the drive makes the wanted motion itself; `largest_speed_rad_per_s` of the drive, `notes` |
| `diagnose` | [diagnosis.json](diagnosis-files.md): `format`, `batch`, `batches` (of several), `verdict`, `is_held`, `location`, `mechanisms`, `laws`, `alternatives`, `likeliest`, `nearest`, `fit`, `repeatability`, `next_experiment`, `not_judged`, `headline`, `provenance`; `out` |
| `check` of `accuracy` | `summary`, `lost`, `gained`, `not_compared` |
| `accept` of `accuracy` | `baseline`, `history`, `batches` |
| `history` of `accuracy` | `history`: a list of its rows; `left_out` |
| `mechanisms` | a list of mechanisms, or with NAME one: `name`, `summary`, `places`, `equation`, `tex`, `signature`, `look_alikes`, `separating_experiment`, `depends_on_rate`, `source`; `parameters`: a list of `name`, `meaning`, `unit` ("1" for a pure number), `low`, `high`, `signed` (both signs are possible), `start`, `default` (`null` if it must be given) |
| `report` | `verdicts`: a list of `batch`, `verdict`, `sentence`, `held_out_error` (by channel `before`, `after`, `noise`, `unit`), `held_out`, `page`; `left_out`, `inconsistent`, `warnings`, `page` |
| `import-mis-tool` | `batches`; `findings`, as of `check` |

`table-one` prints its `summary.json`.

## Exit codes

| code | meaning |
|---|---|
| 0 | Done. `diagnose` ends with 0 at any verdict. |
| 1 | Done, with a finding, or something was left out. `diagnose`: only with `--strict`, if the model does not agree, or with `--keep-law`, if no law was learned. |
| 2 | The input cannot be used: a file, a folder, an option. Standard error has a line for each problem. |
| 70 | An error of the program: its traceback is on standard error. Please report it. |
| 130 | Interrupted by Ctrl-C (143: by the request to end, SIGTERM). |
| 141 | The reader of standard output has gone, as in `ccmodel check BATCH \\| head -1`. Nothing is printed about it. |

An interrupted command says in one line what it has written and how to go on. Files are written beside their place and
renamed at the end, so that a kill or a full disk leaves the earlier result or the new one, never a mixture: an earlier
verdict goes first and the new one comes last, an import replaces its folder as a whole, and other files stay. What a
kill in between leaves in a folder `.unfinished-files`, the next run brings back to its places.

## Completion

`ccmodel --install-completion` makes the shell (bash, zsh, fish, PowerShell) complete commands, options, folders of
batches and names of mechanisms; it takes effect in the next shell. `ccmodel --show-completion` prints the script
instead.

## Commands

"""


def page(group: Any) -> str:
    """The page of a group of commands, whose class Typer does not export: Markdown."""
    context = typer.Context(group, info_name="ccmodel")
    commands = [group.get_command(context, name) for name in group.list_commands(context)]
    sections = [
        get_docs_for_click(obj=command, ctx=context, indent=2, call_prefix="ccmodel")
        for command in commands
        if not command.hidden
    ]
    text = re.sub(r"^\* `(-h, )?--help`.*\n", "", "".join(sections), flags=re.MULTILINE)
    examples = re.compile(r"^Examples?:\n\n((?:  ccmodel .*\n\n)+)", re.MULTILINE)
    return HEAD + examples.sub(_block, text).rstrip("\n") + "\n"


def _block(found: re.Match) -> str:
    """Examples as a block of code."""
    lines = found[1].split("\n\n")[:-1]
    return "**Examples**:\n\n```sh\n" + "\n".join(line.strip() for line in lines) + "\n```\n\n"
