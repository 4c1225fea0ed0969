import numpy as np
import pytest
from made_up_lab import recording, write_text
from pydantic import ValidationError

from ccmodel.rig.importing import import_files
from ccmodel.rig.importing.draft import map_text
from ccmodel.rig.importing.guess import Guess, GuessedFile
from ccmodel.rig.importing.map import Clock, TimeSource, load_map
from ccmodel.typed import InputError

GOOD = """\
format: 1
time: {signal: t, unit: s}
channels:
  theta_in_rad: {signal: q, unit: rad}
  F_drive_N: {signal: F, unit: N}
"""


HOSTILE = ("a\n  tau_in_Nm: {signal: odd, unit: Nm}\n  # b", "a\x85  tau_in_Nm: {signal: odd}", "\x1b]0;evil\x07")


@pytest.mark.parametrize("text", HOSTILE)
def test_no_text_of_a_file_becomes_a_line_of_the_map(tmp_path, text):
    guesses = (
        Guess(text, "theta_in_rad", "rad", sure=True, why=(text,)),
        Guess("q", None, text, why=(text, text)),
    )
    guessed = GuessedFile(TimeSource(signal="t", unit="s"), True, text, guesses, (text,))
    written = map_text({"main": guessed}, {}, [text])
    assert not any(c in written for c in "\x85\x1b\x07")
    assert list(load_map(map_of(tmp_path, written)).channels) == ["theta_in_rad"]


def map_of(tmp_path, text):
    path = tmp_path / "map.yaml"
    path.write_text(text)
    return path


def refused(tmp_path, text):
    with pytest.raises(InputError) as caught:
        load_map(map_of(tmp_path, text))
    return str(caught.value)


@pytest.mark.parametrize(
    ("before", "after", "said"),
    [
        ("signal: q,", "signl: q,", "unknown key 'signl' in channels.theta_in_rad; did you mean 'signal'?"),
        ("F_drive_N:", "F_drve_N:", "unknown key 'F_drve_N' in channels; did you mean 'F_drive_N'?"),
        ("unit: N}", "unit: N, sign: 2}", "channels.F_drive_N.sign: must be 1 or -1, found 2"),
        ("unit: rad}", "unit: N}", "channels.theta_in_rad: found 'N', a force; needed is an angle such as 'rad'"),
        ("unit: N}", "unit: V}", "state the gain with its unit, as '0.5 N/V'"),
        ("unit: N}", "unit: V, gain: 10}", "state the gain with its unit, as '10 N/V'"),
        ("unit: N}", "unit: V, gain: 10 Nm/V}", "gives no N; the gain's unit must be that of N per V"),
        ("unit: N}", "unit: N, sign: true}", "channels.F_drive_N.sign: must be a number, found True"),
        ("format: 1", "format: true", "format: must be a number, found True"),
        ("unit: N}", "unit: N, gain: .nan}", "channels.F_drive_N.gain: must be a finite number, or one with its unit"),
        ("unit: N}", "unit: N, gain: [1]}", "channels.F_drive_N.gain: must be a finite number, or one with its unit"),
        ("unit: N}", "unit: N, gain: 0}", "channels.F_drive_N.gain: must not be zero"),
        ("unit: N}", "unit: A, gain: 0 N/A}", "channels.F_drive_N: found '0 N/A'; a gain is a number other than 0"),
        ("unit: N}", "unit: A, gain: 1e400 N/A}", "a gain is a number other than 0"),
        (
            "signal: F,",
            "signal: q, file: main,",
            "signal 'q' is given to theta_in_rad and F_drive_N: a sensor is one column",
        ),
        ("unit: s}", "unit: deg}", "time: found 'deg', an angle; needed is a time such as 's'"),
        ("unit: s}", "unit: s, rate_Hz: 5.0}", "time is either a signal or a rate_Hz"),
        ("signal: F,", "signal: q,", "signal 'q' is given to theta_in_rad and F_drive_N: a sensor is one column"),
        (
            "  theta_in_rad: {signal: q, unit: rad}\n",
            "",
            "the drive angle is missing: state drive_encoder_counts or theta_in_rad",
        ),
        ("  F_drive_N", "  theta_in_rad: {signal: x}\n  F_drive_N", 'duplicate key "theta_in_rad": remove one'),
        (
            "F_drive_N:",
            "drive_encoder_counts:",
            "channels: theta_in_rad and drive_encoder_counts are the same quantity",
        ),
        ("signal: F,", "signal: F, file: far,", "channels.F_drive_N.file: 'far' is none of main"),
        (
            "channels:\n  theta_in_rad: {signal: q, unit: rad}\n  F_drive_N: {signal: F, unit: N}\n",
            "channels:\n",
            "the drive angle is missing: state drive_encoder_counts or theta_in_rad",
        ),
        ("format: 1", "format: 1\nfiles: {far: {pattern: far.csv}}", "needs one * for the part that names"),
        (
            "format: 1",
            "format: 1\nfiles: {far: {pattern: '*.x', clock: {drift: 0.1, offset_s: 0.0}}}",
            "must be at most 0.01",
        ),
        ("format: 1", "format: 1\nfiles: {far: {pattern: '*.x', clock: {}}}", "either an offset_s or a match"),
        (
            "format: 1",
            "format: 1\nrecordings: [{id: a, files: [x.csv]}, {id: a, files: [y.csv]}]",
            "id 'a' is given twice",
        ),
    ],
)
def test_what_is_wrong_is_said_with_its_remedy(tmp_path, before, after, said):
    assert load_map(map_of(tmp_path, GOOD)).channels
    assert before in GOOD
    message = refused(tmp_path, GOOD.replace(before, after))
    assert said in message
    assert message.count("\n") == 0


def import_of(tmp_path, text, **columns):
    log = write_text(tmp_path / "lab" / "run.csv", columns)
    return import_files([log], map_of(tmp_path, text), tmp_path / "batch").recordings["run"]


def test_a_signal_that_is_not_in_the_file_is_named_with_its_nearest(tmp_path):
    r = recording()
    columns = {"t": r["time_s"], "q_motor": r["theta_in_rad"], "F": r["F_drive_N"]}
    with pytest.raises(InputError, match=r"^run.csv: has no signal 'q_moter'; did you mean 'q_motor'\?$"):
        import_of(tmp_path, GOOD.replace("signal: q,", "signal: q_moter,"), **columns)
    with pytest.raises(InputError, match="has no signal 'zzz'; it has t, q_motor, F$"):
        import_of(tmp_path, GOOD.replace("signal: q,", "signal: zzz,"), **columns)


def test_samples_without_a_time_are_named(tmp_path):
    r = recording()
    time = np.array(r["time_s"], float)
    time[[70, 72]] = np.nan
    columns = {"t": time, "q": r["theta_in_rad"], "F": r["F_drive_N"]}
    said = rf"^run.csv: 'q': sample 71 of {time.size} has no time \(and 1 more\): the file is damaged$"
    with pytest.raises(InputError, match=said):
        import_of(tmp_path, GOOD, **columns)


def test_a_file_without_units_needs_them_in_the_map(tmp_path):
    r = recording()
    columns = {"t": r["time_s"], "q": r["theta_in_rad"], "F": r["F_drive_N"]}
    with pytest.raises(
        InputError, match=r"^run.csv: F_drive_N: the file states no unit of 'F': add unit, such as 'N'$"
    ):
        import_of(tmp_path, GOOD.replace(", unit: N", ""), **columns)
    with pytest.raises(InputError, match="states no unit of the time 't': add it to the map"):
        import_of(tmp_path, GOOD.replace("unit: s", ""), **columns)


def test_counts_from_an_angle_that_was_written_with_few_digits(tmp_path):
    r = recording()
    whole = np.round(r["theta_in_rad"] * 4096 / 2 / np.pi)
    column = 'drive_encoder_counts: {signal: q, unit: deg, gain: "11.3777778 count/deg"}'
    text = GOOD.replace("theta_in_rad: {signal: q, unit: rad}", column)
    written = import_of(tmp_path, text, t=r["time_s"], q=np.round(whole * 360 / 4096, 4), F=r["F_drive_N"])
    assert written.table["drive_encoder_counts"].tolist() == whole.tolist()


def test_degrees_are_no_counts(tmp_path):
    r = recording()
    text = GOOD.replace("theta_in_rad: {signal: q, unit: rad}", "drive_encoder_counts: {signal: q, unit: count}")
    with pytest.raises(InputError, match="must be whole counts, found .*: give an angle as theta_in_rad"):
        import_of(tmp_path, text, t=r["time_s"], q=57 * r["theta_in_rad"], F=r["F_drive_N"])


def test_the_map_wins_over_the_file_and_says_so(tmp_path):
    r = recording()
    columns = {"t [s]": r["time_s"], "q [deg]": r["theta_in_rad"], "F [N]": r["F_drive_N"]}
    built = import_of(tmp_path, GOOD, **columns)
    assert built.table["theta_in_rad"].to_numpy() == pytest.approx(r["theta_in_rad"])
    assert "run.csv: 'q' is taken in rad as the map says; the file says deg" in built.remarks
    assert not any("'F' is taken in" in remark for remark in built.remarks)


@pytest.mark.parametrize(("drift", "is_one"), [(-1e-4, True), (1e-4, True), (-1.0, False), (1.0, False)])
def test_a_clock_may_be_fast_or_slow_by_little(drift, is_one):
    if is_one:
        assert Clock(offset_s=0.0, drift=drift).drift == drift
    else:
        with pytest.raises(ValidationError):
            Clock(offset_s=0.0, drift=drift)
