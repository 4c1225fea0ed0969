"""Every example of every help runs, for a person and with --json."""

import glob
import json
import re
import shlex
import shutil

import pytest
import typer
from example_folder import prepare
from typer.main import get_command

from ccmodel.cli import app
from ccmodel.cli.reference import HEAD

# Their result is a text of another kind.
WITHOUT_JSON = {"schema", "reference"}


def leaves(group, context):
    """All commands that are shown, with those of groups."""
    for name in group.list_commands(context):
        command = group.get_command(context, name)
        if hasattr(command, "list_commands"):
            yield from leaves(command, context)
        elif not command.hidden:
            yield command


GROUP = get_command(app)
COMMANDS = list(leaves(GROUP, typer.Context(GROUP)))
EXAMPLES = {c.name: [line.strip() for line in (c.epilog or "").split("\n\n")[1:]] for c in COMMANDS}
# Other examples read what a diagnosis writes.
ORDERED = sorted((line for lines in EXAMPLES.values() for line in lines), key=lambda line: "diagnose" not in line)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return prepare(tmp_path_factory.mktemp("examples"))


@pytest.fixture
def shell(folder, monkeypatch, run):
    """Runs a line as a shell does: with patterns of files, and without where the output goes."""
    monkeypatch.chdir(folder)

    def call(line, *more):
        _, *words = shlex.split(line.partition(" > ")[0])
        return run(*[f for word in words for f in (sorted(glob.glob(word)) if "*" in word else [word])], *more)

    return call


def keys_of(document):
    """Names of the keys at the top of a document, or of a list of them."""
    return {key for one in (document if isinstance(document, list) else [document]) for key in one}


def keys_in_documentation():
    table = HEAD.partition("## Keys of the JSON documents")[2].partition("##")[0]
    return set(re.findall("`([a-z_A-Z]+)`", table))


def test_every_command_has_an_example():
    assert [name for name, lines in EXAMPLES.items() if not lines] == []


@pytest.mark.long
@pytest.mark.parametrize("line", ORDERED)
def test_an_example_runs(line, shell, folder):
    ended = shell(line)
    assert ended.code == 0 or "import-mis-tool" in line, ended
    assert all(message.startswith("warning: ") for message in ended.err.splitlines())
    assert "\x1b" not in ended.out
    if line.endswith("--out out"):
        shutil.copytree(folder / "out", folder / "results/diagnoses/loops")


@pytest.mark.long
def test_the_results_of_examples_are_one_json_document_each(shell, folder):
    # What these examples write is made once, and then kept.
    (folder / "data/raw/my-batch/map.yaml").unlink()
    (folder / "data/raw/bench/batch.yaml").unlink()
    for line in ORDERED:
        if "--json" in line or any(f"ccmodel {name}" in line for name in WITHOUT_JSON):
            continue
        ended = shell(line, "--json")
        assert (ended.code, ended.err) == (0, "") or "import-mis-tool" in line, (line, ended)
        document = json.loads(ended.out)
        undocumented = keys_of(document) - keys_in_documentation()
        assert "table-one" in line or not undocumented, (line, undocumented)
