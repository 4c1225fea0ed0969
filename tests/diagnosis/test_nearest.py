"""The nearest model of an unexplained batch: its errors on held-out recordings are those of no other model."""

from dataclasses import replace

import pytest

from ccmodel.channels import short_name
from ccmodel.diagnosis.candidate import fit
from ccmodel.diagnosis.comparison import Comparison
from ccmodel.diagnosis.discrepancy import Evidence
from ccmodel.diagnosis.hypothesis import Hypothesis
from ccmodel.diagnosis.result import report
from ccmodel.diagnosis.verdict import Judgement
from ccmodel.model.general.run import Active
from made_observations import NOISE, PARAMETERS, batch, calibrated

SCALE = "torque-scale/drive-sensor/gain"


def test_its_held_out_errors_stand_apart_from_those_of_the_verdict():
    gain = Active("torque-scale", "drive-sensor", {"gain": 0.1})
    recordings = batch(truth=replace(PARAMETERS, mechanisms=(gain,)))
    base = calibrated(recordings)
    hypothesis = Hypothesis((("torque-scale", "drive-sensor"),))
    nearest = fit(recordings, hypothesis, base.free, base.values | {SCALE: 0.05})
    far, near = (Evidence(log, log, log, {"tau_in_Nm": log}, 0.0, 0.01) for log in (-500.0, -10.0))
    comparison = Comparison(recordings, base, [nearest], {base.hypothesis: far, hypothesis: near}, screened=1)
    found = report("b", Judgement("unexplained", base, comparison, [nearest], [1.0], []), base, PARAMETERS, [])
    error, of_nearest = found["fit"]["error"], found["nearest"]["error"]
    assert {c: e["after"] for c, e in error.items()} == {c: e["before"] for c, e in error.items()}
    assert of_nearest["tau_in"]["before"] == error["tau_in"]["before"] > 3 * of_nearest["tau_in"]["after"]
    for channel, sd in NOISE.items():
        assert of_nearest[short_name(channel)]["after"] == pytest.approx(sd, rel=0.5)


def test_other_verdicts_have_none():
    recordings = batch()
    base = calibrated(recordings)
    found = report(
        "b", Judgement("agrees", base, Comparison(recordings, base, [], {}), [], [], []), base, PARAMETERS, []
    )
    assert found["nearest"] is None
