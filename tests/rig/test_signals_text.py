"""Text of any layout: separators, decimal signs, encodings, header lines, units, comments, times of day."""

import gzip
from datetime import UTC, datetime

import numpy as np
import pytest
import sample_files as sample

from ccmodel.rig.findings import LogError
from ccmodel.rig.readers import TextLayout, read_signals
from ccmodel.rig.readers.names import is_unit, split_unit, unique

NUMBERS = {"time": sample.TIME, "angle": sample.ANGLE, "torque": sample.TORQUE}


def read(tmp_path, content, name="log.txt", encoding="utf-8", layout=None):
    path = tmp_path / name
    path.write_bytes(content if isinstance(content, bytes) else content.encode(encoding))
    return read_signals(path, layout)


def columns(file):
    return {s.name: (s.unit, s.values.tolist()) for s in file.signals}


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "utf-16-le", "utf-32", "cp1252"])
@pytest.mark.parametrize(
    ("separator", "decimal"), [(",", "."), (";", ","), ("\t", ","), ("|", "."), (" ", ","), ("  ", ".")]
)
def test_numbers_names_and_units_of_any_layout(tmp_path, separator, decimal, encoding):
    rows = [f"{t}{separator}{a}{separator}{m}" for t, a, m in zip(*NUMBERS.values(), strict=True)]
    rows = [row.replace(".", decimal) if decimal == "," else row for row in rows]
    header = separator.join(["time[s]", "Winkel_Prüfstand[°]", "torque(Nm)"])
    file = read(tmp_path, "\n".join([header, *rows, ""]), encoding=encoding)
    assert [(s.name, s.unit) for s in file.signals] == [("time", "s"), ("Winkel_Prüfstand", "°"), ("torque", "Nm")]
    for signal, values in zip(file.signals, NUMBERS.values(), strict=True):
        assert (signal.values == values).all() and signal.time_s is None
    decimal = "decimal comma" if decimal == "," else "decimal point"
    assert decimal in file.remarks[0] and encoding.removesuffix("-sig") in file.remarks[0]


@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
@pytest.mark.parametrize("name", ["log.csv", "log.TXT", "log.tsv", "log.dat", "log.asc", "log.log", "log"])
def test_any_line_end_and_name(tmp_path, name, end):
    file = read(tmp_path, end.join(["t;x", "0;1,5", "1;2,5", "2;3,5", ""]), name)
    assert columns(file) == {"t": ("", [0, 1, 2]), "x": ("", [1.5, 2.5, 3.5])}


def test_gzipped(tmp_path):
    file = read(tmp_path, gzip.compress(b"t,x\n0,1\n1,2\n2,3\n"), "log.csv.gz")
    assert columns(file) == {"t": ("", [0, 1, 2]), "x": ("", [1, 2, 3])}


HEADERS = {
    "lines of notes above the names": "Rig 7; built 2019\nOperator: A. B.\n\nt;x\n",
    "units below the names": "Rig 7\nt;x\ns;deg\n",
    "units in brackets below the names": "t;x\n[s];[deg]\n",
    "units in the names": "t [s];x (deg)\n",
    "units behind a stroke": "t / s;x / deg\n",
    "units after in": "t in s;x in deg\n",
    "a comment sign before names and units": "# measured by hand\n# t;x\n# s;deg\n",
    "percent signs": "% t;x\n",
    "quoted": '"t";"x [deg]"\n',
    "a line below the units": "t;x\ns;deg\nfloat;float\n",
    "a separator at the end": "t;x;\n",
    "names separated otherwise": "# t, x\n",
    "an empty line below": "t;x\n\n",
    "ranges below": "t;x\n10 V;5 V\n",
    "a note on the separator": "sep=;\nt;x\n",
}


@pytest.mark.parametrize("case", HEADERS)
def test_headers(tmp_path, case):
    file = read(tmp_path, HEADERS[case] + "0;1,5\n1;2,5\n2;3,5\n")
    units = {s.name: s.unit for s in file.signals}
    assert units.keys() == {"t", "x"}
    assert units["x"] == ("deg" if "deg" in HEADERS[case] else "")
    assert file.signals[1].values.tolist() == [1.5, 2.5, 3.5]


def test_names_of_several_words_between_blanks(tmp_path):
    file = read(tmp_path, "% t (s)   drive angle (deg)   F [N]\n  0.0   1.0  2\n  0.1  1.1  3\n 0.2  1.2  4\n")
    assert [(s.name, s.unit) for s in file.signals] == [("t", "s"), ("drive angle", "deg"), ("F", "N")]


def test_without_a_header_columns_are_numbered(tmp_path):
    file = read(tmp_path, "0 1.5\n1 2.5\n2 3.5\n")
    assert columns(file) == {"column_1": ("", [0, 1, 2]), "column_2": ("", [1.5, 2.5, 3.5])}
    assert "no line of names" in file.remarks[0]


@pytest.mark.parametrize("separator", ["\t", ";", ",", "|", " "])
def test_a_date_and_a_time_with_a_blank_between_them_are_one_cell(tmp_path, separator):
    rows = [f"2026-02-03 14:05:0{k}.000{separator}{k / 2}{separator}{k}" for k in range(5)]
    stamp = "Date Time" if separator == " " else "Stamp"
    file = read(tmp_path, "\n".join([separator.join([stamp, "x", "y"]), *rows, ""]))
    assert [s.name for s in file.signals][-2:] == ["x", "y"]
    assert file.signals[0].values.tolist() == [0.0, 1.0, 2.0, 3.0, 4.0]
    assert file.signals[-2].values.tolist() == [0.0, 0.5, 1.0, 1.5, 2.0]


def test_rows_that_end_with_a_separator(tmp_path):
    file = read(tmp_path, "t,x\n0,1,\n1,2,\n2,3,\n")
    assert columns(file) == {"t": ("", [0, 1, 2]), "x": ("", [1, 2, 3])}


def test_two_tables_in_a_file_are_refused(tmp_path):
    content = "t,x\n" + "0,1\n" * 30 + "t,x,y\n" + "0,1,2\n" * 30
    with pytest.raises(LogError) as error:
        read(tmp_path, content)
    assert "has 30 more rows of numbers, of another table, above the samples of line 33 on" in error.value.args[2]
    assert len(read(tmp_path, content, layout=TextLayout(first_line=33)).signals) == 3


def test_a_labview_file(tmp_path):
    head = "LabVIEW Measurement\t\nSeparator\tTab\n***End_of_Header***\t\nChannels\t2\t\nSamples\t3\t3\n"
    head += "***End_of_Header***\t\t\nX_Value\tangle\ttorque\tComment\n"
    file = read(tmp_path, head + "0.0\t1\t2\n0.1\t1\t3\n0.2\t1\t4\n", "log.lvm")
    assert columns(file)["torque"] == ("", [2, 3, 4])


def test_cells_without_a_number_are_nan_and_odd_ones_are_named(tmp_path):
    file = read(tmp_path, "t,x,y\n0,1,\n1,NaN,2\n2,over,3\n3,1e-3,-\n4,2.5D+01,inf\n")
    t, x, y = (s.values for s in file.signals)
    np.testing.assert_array_equal(x, [1, np.nan, np.nan, 1e-3, 25])
    np.testing.assert_array_equal(y, [np.nan, 2, 3, np.nan, np.inf])
    assert "a cell of 'x' holds no number (row 4: 'over')" in file.remarks
    assert t.tolist() == [0, 1, 2, 3, 4]


def test_a_point_between_thousands_is_no_decimal_point(tmp_path):
    """A German export writes 1021 as 1.021: the cell is named, and never read as 1.021."""
    counts = np.arange(0, 1100, 10)
    cells = [f"{count:,}".replace(",", ".") for count in counts.tolist()]
    file = read(tmp_path, "t;x\n" + "".join(f"0,{i:03d};{cell}\n" for i, cell in enumerate(cells)))
    np.testing.assert_array_equal(file.signals[1].values, np.where(counts < 1000, counts, np.nan))
    assert "10 cells of 'x' hold no number (row 102: '1.000')" in file.remarks


@pytest.mark.parametrize(("separator", "decimal"), [(",", "."), (";", ",")])
def test_infinite_and_missing_numbers_of_a_c_program(tmp_path, separator, decimal):
    words = ("1.#INF", "-1.#INF", "1.#QNAN", "-1.#IND", "2.5")
    rows = [separator.join((f"0.{i}", word)) for i, word in enumerate(words * 5)]
    file = read(tmp_path, "\n".join([separator.join("tx"), *(row.replace(".", decimal) for row in rows), ""]))
    np.testing.assert_array_equal(file.signals[1].values, [np.inf, -np.inf, np.nan, np.nan, 2.5] * 5)
    assert not any("no number" in remark for remark in file.remarks)


def test_a_channel_with_few_entries_is_kept_and_one_without_is_not(tmp_path):
    rows = "".join(f"{i},{i},,{'7' if i == 3 else ''}\n" for i in range(100))
    file = read(tmp_path, "t,x,empty,seldom\n" + rows)
    assert [s.name for s in file.signals] == ["t", "x", "seldom"]
    assert np.flatnonzero(np.isfinite(file.signals[2].values)).tolist() == [3]
    assert "columns without an entry are left out: empty" in file.remarks


def test_columns_of_text_and_lines_of_comment_are_left_out_and_named(tmp_path):
    file = read(tmp_path, "t,state,x\n0,RUN,1\n1,RUN,2\n# paused\n2,STOP,3\nend of file\n")
    assert columns(file) == {"t": ("", [0, 1, 2]), "x": ("", [1, 2, 3])}
    said = " ".join(file.remarks)
    assert (
        "columns of text are left out: state (such as 'STOP')" in said
        and "1 lines of comment" in said
        and "below the samples" in said
    )


def test_a_last_line_without_an_end_is_left_out(tmp_path):
    file = read(tmp_path, "t,x\n0,1\n1,2\n2,3\n3,4")
    assert file.signals[1].values.tolist() == [1, 2, 3]
    assert "the last line has no line end: it may be cut and is left out" in file.remarks


STAMPS = {
    "iso": ("{d:%Y-%m-%d %H:%M:%S}.{ms:03d}", ","),
    "iso with T and zone": ("{d:%Y-%m-%dT%H:%M:%S}.{ms:03d}+00:00", ","),
    "German": ("{d:%d.%m.%Y %H:%M:%S},{ms:03d}", ";"),
    "American": ("{d:%m/%d/%Y %I:%M:%S}.{ms:03d} PM", ","),
    "strokes": ("{d:%Y/%m/%d %H:%M:%S}.{ms:03d}", ","),
    "date and time in columns": ("{d:%d.%m.%Y};{d:%H:%M:%S},{ms:03d}", ";"),
    "date and time between blanks": ("{d:%Y-%m-%d} {d:%H:%M:%S}.{ms:03d}", " "),
    "time of day": ("{d:%H:%M:%S}.{ms:03d}", ","),
}


@pytest.mark.parametrize("case", STAMPS)
def test_times_of_day_become_seconds_from_the_first(tmp_path, case):
    pattern, separator = STAMPS[case]
    start = datetime(2024, 5, 31, 12, tzinfo=UTC)
    stamps = [pattern.format(d=start.replace(second=ms // 1000), ms=ms % 1000) for ms in range(0, 3000, 250)]
    file = read(tmp_path, "".join(f"{stamp}{separator}{i}\n" for i, stamp in enumerate(stamps)))
    time, value = file.signals
    np.testing.assert_allclose(time.values, 0.25 * np.arange(12), atol=1e-9)
    assert time.unit == "s" and value.values.tolist() == list(range(12))
    assert file.started == (None if case == "time of day" else start)


def test_times_of_day_run_over_midnight(tmp_path):
    file = read(tmp_path, "23:59:59.5,1\n00:00:00.0,2\n00:00:00.5,3\n")
    assert file.signals[0].values.tolist() == [0, 0.5, 1]


def test_a_stated_layout_is_followed(tmp_path):
    content = "1;2\n3;4\na,b;x\nc;d\n0;1\n1;2\n2;3\n"
    layout = TextLayout(separator=";", decimal=".", encoding="latin-1", header_line=3, unit_line=4, first_line=6)
    file = read(tmp_path, content, layout=layout)
    assert columns(file) == {"a,b": ("c", [1, 2]), "x": ("d", [2, 3])}
    file = read(tmp_path, "t,x\n0,1\n1,2\n2,3\n", layout=TextLayout(header_line=0))
    assert [s.name for s in file.signals] == ["column_1", "column_2"]


@pytest.mark.parametrize(
    ("layout", "said"),
    [
        ({"separator": "::"}, "text.separator: must be one character or 'whitespace', found '::'"),
        ({"encoding": "utf-99"}, "text.encoding: 'utf-99' is no known encoding"),
        ({"first_line": 9}, "text.first_line: the file has 4 lines only, found 9"),
        ({"header_line": 3, "first_line": 2}, "text.header_line: must be a line above the samples"),
        ({"separator": "|"}, "no rows of numbers"),
    ],
)
def test_a_wrong_layout_is_named(tmp_path, layout, said):
    with pytest.raises(LogError) as error:
        read(tmp_path, "t,x\n0.1,1.5\n0.2,2\n0.3,3\n", layout=TextLayout(**layout))
    assert said in error.value.args[2]


@pytest.mark.parametrize(("key", "what"), [("header_line", "names"), ("unit_line", "units")])
def test_a_stated_line_of_another_width_is_named(tmp_path, key, what):
    with pytest.raises(LogError) as error:
        read(tmp_path, "Rig 7\nt,x\n0,1\n1,2\n2,3\n", layout=TextLayout(**{key: 1}))
    assert error.value.args[0] == 1
    assert f"the {what} have another number of cells than the 2 of the samples" in error.value.args[2]
    assert f"{key} 0 if it has no {what}" in error.value.args[2]


def test_a_row_of_another_width_is_named(tmp_path):
    with pytest.raises(LogError) as error:
        read(tmp_path, "t,x\n" + "".join(f"{i},1\n" for i in range(50)) + "50,1,7\n51,1\n52,1\n53,1\n")
    assert error.value.args[0] == 52 and "has 3 cells, the other rows 2" in error.value.args[2]


def test_separators_at_the_end_of_some_rows_hold_no_cell(tmp_path):
    file = read(tmp_path, "t,x\n" + "".join(f"{i},{i + 0.5}{',' * (i == 20)}{', ,' * (i == 30)}\n" for i in range(50)))
    assert columns(file)["x"][1] == [i + 0.5 for i in range(50)]


def test_names_and_units():
    assert split_unit("angle [deg]") == ("angle", "deg")
    assert split_unit("angle (filtered)") == ("angle (filtered)", "")
    assert split_unit("torque (mN·m)") == ("torque", "mN·m")
    assert split_unit("rate / rad/s") == ("rate / rad/s", "") or split_unit("rate / rad/s") == ("rate", "rad/s")
    assert split_unit("T1/T3 ratio") == ("T1/T3 ratio", "")
    assert all(map(is_unit, ["s", "[deg]", "N*m", "N m", "rad/s^2", "m/s²", "counts", "°", "-", "()"]))
    assert not any(map(is_unit, ["time", "angle", "T1", "current drive", "F_load"]))
    assert unique(["a", "b", "a", "a", "a (2)"]) == ["a", "b", "a (3)", "a (4)", "a (2)"]


def test_a_long_header_does_not_hide_a_short_recording(tmp_path):
    notes = "".join(f"key {i}: value, {i}\n" for i in range(60))
    file = read(tmp_path, notes + "t,x\n" + "".join(f"{i},{i}\n" for i in range(12)))
    assert columns(file)["x"] == ("", list(range(12)))
