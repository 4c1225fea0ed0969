"""One style of options, and a page that documents them."""

from pathlib import Path

import pytest
import typer
from test_cli_examples import COMMANDS, GROUP

from ccmodel import __version__
from ccmodel.cli import FormerOptions
from ccmodel.cli.completion import batch_folders, candidates, mechanisms
from ccmodel.cli.reference import page

ROOT = Path(__file__).parents[2]


def options():
    return [
        (command, parameter)
        for command in COMMANDS
        for parameter in command.get_params(typer.Context(command))
        if parameter.param_type_name == "option"
    ]


def test_the_same_option_has_the_same_meaning_and_type_in_all_commands():
    seen = {}
    for command, option in options():
        for name in option.opts:
            # What is written differs from command to command.
            meaning = None if name == "--out" else option.help
            kind = (option.get_help_record(typer.Context(command))[0], option.multiple, meaning)
            assert seen.setdefault(name, kind) == kind, (command.name, name)


def test_every_command_that_prints_a_result_has_json():
    without = {c.name for c in COMMANDS} - {c.name for c, o in options() if "--json" in o.opts}
    assert without == {"schema", "reference"}


def test_options_and_arguments_have_a_help():
    for command in COMMANDS:
        assert command.help
        assert all(p.help for p in command.get_params(typer.Context(command)) if p.name != "help"), command.name


def test_commands_are_in_panels_in_the_order_of_the_work():
    names = GROUP.list_commands(typer.Context(GROUP))
    model = ["fit", "simulate", "predict", "estimate", "compensate", "diagnose"]
    work = ["init", "import", "check", *model, "accuracy", "mechanisms", "report"]
    assert names[: len(work)] == work
    assert all(c.rich_help_panel for c in GROUP.commands.values() if not c.hidden)


def test_the_page_is_up_to_date():
    text = (ROOT / "docs/command-line.md").read_text(encoding="utf-8")
    assert text == page(GROUP), "write it again: ccmodel reference > docs/command-line.md"


def test_version(run):
    assert run("--version") == (0, f"ccmodel {__version__}\n", "")


def test_without_arguments_the_help_is_shown(run):
    for words in ((), ("accuracy",)):
        ended = run(*words)
        assert ended.code == 2
        assert "Usage: ccmodel" in ended.out


@pytest.mark.parametrize("former, present", [*FormerOptions.renamed.items(), ("left-out", "report")])
def test_former_names_still_work_with_a_message(former, present, run, tmp_path):
    words = [former, tmp_path] if former == "left-out" else ["diagnose", tmp_path, "--out", tmp_path / "out", former]
    ended = run(*words, *(["x"] if former.startswith("--") and former != "--hold" else []))
    assert ended.code == 2
    assert present in ended.err.splitlines()[0]
    assert "No such" not in ended.err


def test_completion_knows_mechanisms_and_batches(tmp_path, monkeypatch):
    assert mechanisms("pul") == ["pulley-eccentricity", "pulley-friction"]
    assert "kink at conduit" in candidates("kin")
    assert candidates("kink at conduit,backl")[0].startswith("kink at conduit,backlash at ")
    for name in ("loops", "looks", "other"):
        (tmp_path / "raw" / name).mkdir(parents=True)
    (tmp_path / "raw/loops/batch.yaml").touch()
    monkeypatch.chdir(tmp_path)
    assert batch_folders("ra") == ["raw/"]
    assert batch_folders("raw/loo") == ["raw/looks/", "raw/loops"]
    assert batch_folders("nowhere/x") == []


def test_a_shell_completes_names(monkeypatch, capsys):
    monkeypatch.setenv("_CCMODEL_COMPLETE", "complete_bash")
    monkeypatch.setenv("COMP_WORDS", "ccmodel mechanisms backl")
    monkeypatch.setenv("COMP_CWORD", "2")
    with pytest.raises(SystemExit):
        GROUP.main([], prog_name="ccmodel")
    assert capsys.readouterr().out.split() == ["backlash"]
