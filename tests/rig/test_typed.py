from typing import Annotated, Literal

import pytest
from pydantic import Field

from ccmodel.typed import InputError, NotNegative, Positive, TypedModel, load_yaml_model


class Inner(TypedModel):
    length_m: Positive
    sign: Literal[1, -1] = 1


class Outer(TypedModel):
    name: str
    pieces: tuple[Inner, ...]
    by_name: dict[str, Inner] = Field(default_factory=dict)
    choice: Inner | None = None
    friction: NotNegative = 0.1
    short: Annotated[tuple[Inner, ...], Field(min_length=1)] | None = None
    word: Annotated[str, Field(min_length=2)] = "word"
    code: Annotated[str, Field(pattern="^[a-c]{1}$")] = "a"
    bounds: dict[Literal["low_N", "high_N"], float] = Field(default_factory=dict)


GOOD = "name: a\npieces:\n- {length_m: 1}\n- length_m: 5e-1\n"


def read(tmp_path, text):
    path = tmp_path / "x.yaml"
    path.write_text(text)
    return load_yaml_model(path, Outer)


def test_numbers_with_exponents(tmp_path):
    model = read(tmp_path, GOOD + "friction: 5e-2\n")
    assert [p.length_m for p in model.pieces] == [1.0, 0.5]
    assert model.friction == 0.05


@pytest.mark.parametrize(
    ("text", "line", "message"),
    [
        (GOOD + "frictoin: 1\n", 5, "unknown key 'frictoin' at the top level; did you mean 'friction'?"),
        (GOOD + "zzz: 1\n", 5, "known keys are name, pieces, by_name"),
        ("name: a\npieces:\n- lenght_m: 1\n", 3, "unknown key 'lenght_m' in pieces[0]; did you mean 'length_m'?"),
        (GOOD + "by_name:\n  b:\n    length_m: 1\n    sing: 1\n", 8, "'sing' in by_name.b; did you mean 'sign'?"),
        (GOOD + "choice:\n  length_m: 1\n  sgn: 1\n", 7, "unknown key 'sgn' in choice; did you mean 'sign'?"),
        (GOOD + "bounds: {lo_N: 1}\n", 5, "unknown key 'lo_N' in bounds; did you mean 'low_N'?"),
        ("name: a\npieces:\n- {sign: 1}\n", 3, "key 'length_m' is missing in pieces[0]"),
        ("name: 3\npieces: []\n", 1, "name: must be text (put it in quotes), found 3"),
        (GOOD + "friction: fast\n", 5, "friction: must be a number, found 'fast'"),
        (GOOD + "friction: true\n", 5, "friction: must be a number, found True"),
        (GOOD + "friction: .nan\n", 5, "friction: must be"),
        (GOOD + "friction: -1\n", 5, "friction: must be at least 0.0, found -1"),
        ("name: a\npieces: [{length_m: 0}]\n", 2, "pieces[0].length_m: must be above 0.0, found 0"),
        ("name: a\npieces: [{length_m: 1, sign: 2}]\n", 2, "pieces[0].sign: must be 1 or -1, found 2"),
        ("name: a\npieces: 3\n", 2, "pieces: must be a list, found 3"),
        ("name: a\npieces: []\nname: b\n", 3, 'found duplicate key "name": remove one'),
        ("name: [a\npieces: 3\n", 2, "not valid YAML"),
        ("name: a\n\tpieces: 3\n", 2, "not valid YAML"),
        ("", None, "must hold keys and values, found nothing"),
        ("- 1\n", None, "must hold keys and values, found a list"),
        (GOOD + "note: 2026-02-30\n", 5, "'2026-02-30' cannot be read (day is out of range for month): if it is text"),
        (GOOD + "friction: !!bool fast\n", 5, "'fast' cannot be read"),
        (GOOD + "friction: !!timestamp fast\n", 5, 'failed to construct timestamp from "fast"'),
        (GOOD + "? [1, 2]\n: x\n", 5, "a key must be a word, found a list or a mapping"),
        ("name: a\npieces: {[a]: b}\n", 2, "a key must be a word"),
        (GOOD + "choice: {{a: 1}: 2}\n", 5, "a key must be a word"),
        (GOOD + "2026-01-01: 2\n", 5, "unknown key '2026-01-01' at the top level"),
        (GOOD + "on: 2\n", 5, "unknown key 'on' at the top level"),
        (GOOD + '"a\\nb": 2\n', 5, "unknown key 'a\\nb' at the top level"),
        (GOOD + "choice: &x [*x]\n", 5, "holds what cannot be read as keys and values"),
        (GOOD + "choice: &x {a: *x}\n", 5, "holds what cannot be read as keys and values"),
        (GOOD + "choice: " + "[" * 5000 + "\n", 5, "not valid YAML: maximum depth of data structure exceeded (51)"),
        (GOOD + 'name2: "\\U00110000"\n', None, "not valid YAML: chr() arg not in range"),
        (GOOD + 'name2: "\\ud800"\n', 1, "nvalid JSON"),
        (GOOD + "short: []\n", 5, "short: needs at least 1 entries, has 0"),
        (GOOD + "short:\n- {length_m: 1, sing: 1}\n", 6, "unknown key 'sing' in short[0]; did you mean 'sign'?"),
        (GOOD + "word: ''\n", 5, "word: needs at least 2 characters, found ''"),
        (GOOD + "code: z\n", 5, "code: String should match pattern '^[a-c]{1}$', found 'z'"),
    ],
    ids=lambda value: repr(value)[:60],
)
def test_one_clear_line_a_problem(tmp_path, text, line, message):
    with pytest.raises(InputError) as raised:
        read(tmp_path, text)
    (problem,) = raised.value.problems
    assert str(problem) == str(raised.value)
    assert "\n" not in str(problem)
    assert problem.line == line
    assert message in problem.text
    assert problem.file.endswith("x.yaml")


@pytest.mark.parametrize("text", ["yes", "12:30", "0x", "1 000"])
def test_text_of_yaml_1_2_is_no_number(tmp_path, text):
    with pytest.raises(InputError, match=f"friction: must be a number, found '{text}'"):
        read(tmp_path, GOOD + f"friction: {text}\n")


def test_an_unknown_tag_has_no_effect_on_the_type(tmp_path):
    with pytest.raises(InputError, match="friction: must be a number"):
        read(tmp_path, GOOD + "friction: !!python/object:os.system x\n")


def test_every_problem_is_reported(tmp_path):
    with pytest.raises(InputError) as raised:
        read(tmp_path, "name: 1\npieces: [{length_m: -1}]\nfoo: 1\n")
    assert len(str(raised.value).splitlines()) == len(raised.value.problems) == 3


def test_missing_file(tmp_path):
    with pytest.raises(InputError, match=r"nowhere\.yaml: there is no such file"):
        load_yaml_model(tmp_path / "nowhere.yaml", Outer)


def test_bytes_that_are_no_text(tmp_path):
    (tmp_path / "x.yaml").write_bytes(b"name: \xff\xfe")
    with pytest.raises(InputError, match="is not text in UTF-8: save it in this encoding"):
        load_yaml_model(tmp_path / "x.yaml", Outer)


def test_keys_are_text(tmp_path):
    model = read(tmp_path, GOOD + "by_name:\n  2026-01-01: &a {length_m: 1}\n  yes: {<<: *a, sign: -1}\n  1: *a\n")
    assert {name: (p.length_m, p.sign) for name, p in model.by_name.items()} == {
        "2026-01-01": (1, 1),
        "yes": (1, -1),
        "1": (1, 1),
    }
