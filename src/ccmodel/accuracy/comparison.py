"""Compare the accuracy of a run with an accepted one: which channel of which batch has a loss.

What decides is the normalised error E of a channel of a batch with a parameter set (`ccmodel.accuracy.measure`), since
it contains bias and scatter. The change is D = ln(E now / E accepted). There are two cases.

**The same recordings** (equal digests of the raw files of the batch and of the batches that the set was fitted to). The
pipeline is deterministic, so that noise, zeros and friction of the runs cancel and every change is one of the code.
Only another machine or library can move E without a better or worse model, which is allowed a share q of E:

    loss:  D > ln(1 + q).

**Recorded again.** The sensors' noise, their zeros, and friction and tension of the runs are drawn anew. Their effect
is seen between repeats of a condition. Let s be the pooled standard deviation of ln error_r between repeats, over all
batches of the rig, for the same channel and set, with nu degrees of freedom (that of the batch's own repeats if it is
larger; a rig without repeats: that between all recordings of a batch, which also contains the conditions). Since E is
the root of a mean of squares, ln E has the variance s^2 sum w_r^2 with w_r = error_r^2 / sum error_r^2. The errors of a
fit are common to all recordings and not seen between repeats; u is the standard deviation of ln E due to them. Then

    loss:  D > ln(1 + q) + t sqrt(s^2 (sum w^2 accepted + sum w^2 now) + 2 u^2),
           t the quantile of 1 - alpha / m of Student's distribution with nu degrees of freedom.

alpha = 1 - coverage is the probability of one or more false alarms in a whole run: with m comparisons of channels,
batches and sets each is made at alpha / m (Bonferroni; the channels of a recording are correlated, so that the rate is
lower). A run of the same sources on the same recordings has D = 0 and raises none. Both rates take a set as a model of
fixed form: where other noise changes what a diagnosis identifies, its extended model is another one, and a loss of it
is a loss of the diagnosis.

An equal error over less data is no equal accuracy. A channel, a recording or a part of more than a tenth of the time
that was compared before and is not any more is therefore a loss too. So is, on the same recordings, a verdict that
determines less (`VERDICTS`).
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field

import numpy as np
from pydantic import Field

from ccmodel.accuracy.measure import BatchAccuracy, Batches, ChannelAccuracy
from ccmodel.channels import symbol_of
from ccmodel.distributions import student_quantile
from ccmodel.repeats import pooled_scatter, without_repeat
from ccmodel.typed import TypedModel

# Numbers of a channel by recording; None where there is none.
Values = Callable[[ChannelAccuracy], Sequence[float | None]]

# From the one that determines least; `agrees`, `explained` and `learned` determine all.
VERDICTS = {
    "not diagnosed": 0,
    "inputs-inconsistent": 0,
    "unexplained": 1,
    "undecided": 2,
    "learned": 3,
    "explained": 3,
    "agrees": 3,
}
LOST, GAINED, KEPT, UNKNOWN = "lost", "gained", "kept", "not judged"
# Share of the compared time of a recording that may be missing.
SHORTER = 0.1
# A half width of ln error beyond this is no interval: the repeats are too few.
WIDE = 10.0


class Limits(TypedModel):
    """How sure a loss must be."""

    coverage: float = Field(
        0.99, gt=0, lt=1, description="probability that recordings made again give no false alarm in a whole run"
    )
    reproducibility: float = Field(
        0.01, ge=0, lt=1, description="share of an error by which another machine or library may change it"
    )


@dataclass(frozen=True)
class Change:
    """One channel of one batch with one parameter set, accepted and now; errors in % of peak to peak.

    Attributes
    ----------
    batch, parameters, channel : str
    accepted, now : float
        Normalised error.
    accepted_bias, now_bias : float
        Bias.
    low, high : float or None
        Errors between which there is neither gain nor loss; None if the recordings do not determine them.
    same_recordings : bool
    outcome : str
        One of `LOST`, `GAINED`, `KEPT`, `UNKNOWN`.
    """

    batch: str
    parameters: str
    channel: str
    accepted: float
    now: float
    accepted_bias: float
    now_bias: float
    low: float | None
    high: float | None
    same_recordings: bool
    outcome: str

    @property
    def percent(self) -> float:
        """Change of the error, % of the accepted one."""
        return 100 * (self.now / self.accepted - 1)

    @property
    def times(self) -> str:
        """The change in words: a share, or a factor where it is large."""
        return f"{self.percent:+.1f} %" if self.percent < 900 else f"{self.now / self.accepted:.0f} times"

    def __str__(self) -> str:
        basis = "same recordings" if self.same_recordings else "recorded again"
        reach = "no interval, too few repeats"
        if self.high is not None:
            reach = f"interval {self.low:.3g} to {self.high:.3g} %"
        place = f"batch {self.batch}, {symbol_of(self.channel)} with {self.parameters} parameters"
        error = f"error {self.accepted:.3g} % -> {self.now:.3g} % of peak to peak"
        return f"{place}: {error} ({self.times}; {reach}, {basis})"


@dataclass(frozen=True)
class Comparison:
    """Result of a comparison.

    Attributes
    ----------
    changes : list of Change
        All comparisons.
    verdicts : list of dict
        Verdicts that changed: ``batch``, ``accepted``, ``now``, ``lost``.
    less : list of str
        A line on each batch, set, channel or recording that was compared before and is not any more.
    unknown : list of str
        A line on each batch, set or channel that the baseline does not have.
    again : list of str
        Batches whose raw files are not those of the baseline.
    """

    changes: list[Change] = field(default_factory=list)
    verdicts: list[dict] = field(default_factory=list)
    less: list[str] = field(default_factory=list)
    unknown: list[str] = field(default_factory=list)
    again: list[str] = field(default_factory=list)

    def of(self, outcome: str) -> list[Change]:
        """Changes of one outcome, the largest first."""
        return sorted((c for c in self.changes if c.outcome == outcome), key=lambda c: -abs(c.percent))

    @property
    def losses(self) -> list[str]:
        """A line on each loss."""
        verdicts = [f"batch {v['batch']}: verdict {v['accepted']} -> {v['now']}" for v in self.verdicts if v["lost"]]
        return [*map(str, self.of(LOST)), *verdicts, *self.less]

    @property
    def not_compared(self) -> list[str]:
        """A line on each thing that could not be compared."""
        return [*self.unknown, *map(str, self.of(UNKNOWN))]

    def as_dict(self) -> dict:
        """Plain data, for the page."""
        changes = [asdict(c) | {"times": c.times} for c in self.changes]
        return asdict(self) | {"changes": changes, "losses": self.losses, "not_compared": self.not_compared}


def compare(accepted: Batches, now: Batches, limits: Limits) -> Comparison:
    """Compare a run with the accepted accuracy, by the rules above."""
    found = Comparison()
    found.less.extend(_less(accepted, now))
    common = [batch for batch in now if batch in accepted]
    found.unknown.extend(_unknown(accepted, now))
    found.again.extend(batch for batch in common if accepted[batch].digest != now[batch].digest)
    places = [(b, p, c) for b in common for p, c in _channels(now[b]) if (p, c) in set(_channels(accepted[b]))]
    tail = (1 - limits.coverage) / max(len(places), 1)
    found.changes.extend(_change(*place, accepted, now, limits.reproducibility, tail) for place in places)
    for batch in common:
        before, after = accepted[batch], now[batch]
        if before.verdict != after.verdict and before.verdict and after.verdict:
            lost = batch not in found.again and _rank(after.verdict) < _rank(before.verdict)
            found.verdicts.append({"batch": batch, "accepted": before.verdict, "now": after.verdict, "lost": lost})
    return found


def intervals(batches: Batches, limits: Limits) -> Iterator[tuple[str, str, str, dict[str, list[float | None]]]]:
    """Bias, scatter and error of every batch, set and channel with the interval that holds it if it is recorded again.

    With the probability `limits.coverage` no bias is outside its interval, no error or scatter above its own, and none
    below it. The interval of the error is the one of `compare`.
    """
    places = [(batch, p, c) for batch in batches for p, c in _channels(batches[batch])]
    tail = (1 - limits.coverage) / max(len(places), 1)
    for batch, parameters, channel in places:
        one = batches[batch].sets[parameters].channels[channel]
        sd, freedom = _scatter(batches, batch, parameters, channel, lambda one: one.biases)
        bias_sd = sd * np.sqrt(2 / _numbers(one.biases).size)
        reach = float(-student_quantile(tail / 2, freedom) * bias_sd) if freedom else None
        bias = [None, None] if reach is None else [one.bias - reach, one.bias + reach]
        # ln of error and scatter move alike in the mean: both are roots of mean squares over the same samples.
        reach = _reach_again(batches, batches, batch, parameters, channel, tail)
        scatter, error = _range(one.scatter, reach), _range(one.error, reach)
        values = {"bias": [one.bias, *bias], "scatter": [one.scatter, *scatter], "error": [one.error, *error]}
        yield batch, parameters, channel, values


def _change(
    batch: str, parameters: str, channel: str, accepted: Batches, now: Batches, share: float, tail: float
) -> Change:
    before, after = (of[batch].sets[parameters].channels[channel] for of in (accepted, now))
    same = _same_recordings(batch, parameters, accepted, now)
    if same:
        before, after = _common(before, accepted[batch], now[batch]), _common(after, now[batch], accepted[batch])
        reach: float | None = 0.0
    else:
        reach = _reach_again(accepted, now, batch, parameters, channel, tail)
    low, high = _range(before.error, None if reach is None else reach + np.log1p(share))
    outcome = (
        UNKNOWN
        if low is None or high is None
        else LOST
        if after.error > high
        else GAINED
        if after.error < low
        else KEPT
    )
    return Change(
        batch, parameters, channel, before.error, after.error, before.bias, after.bias, low, high, same, outcome
    )


def _same_recordings(batch: str, parameters: str, accepted: Batches, now: Batches) -> bool:
    used = {batch, *accepted[batch].sets[parameters].fitted_to, *now[batch].sets[parameters].fitted_to}
    return all(b in accepted and b in now and accepted[b].digest == now[b].digest for b in used)


def _common(one: ChannelAccuracy, mine: BatchAccuracy, other: BatchAccuracy) -> ChannelAccuracy:
    """The numbers of recordings that both have, in one order."""
    at = {name: k for k, name in enumerate(mine.recordings)}
    kept = [at[name] for name in sorted(at.keys() & other.recordings.keys())]
    return one.model_copy(update={"biases": [one.biases[k] for k in kept], "errors": [one.errors[k] for k in kept]})


def _reach_again(
    accepted: Batches, now: Batches, batch: str, parameters: str, channel: str, tail: float
) -> float | None:
    """Half width of the interval of ln E if the batch is recorded again; None if the recordings do not determine it."""
    sd, freedom = _scatter(accepted, batch, parameters, channel, _log_errors)
    if not freedom:
        return None
    variance = 0.0
    for one in (of[batch].sets[parameters].channels[channel] for of in (accepted, now)):
        squares = _numbers(one.errors) ** 2
        variance += sd**2 * float(((squares / squares.sum()) ** 2).sum()) + one.fit_sd**2
    return float(-student_quantile(tail, freedom) * np.sqrt(variance))


def _scatter(batches: Batches, batch: str, parameters: str, channel: str, values: Values) -> tuple[float, int]:
    """Standard deviation between repeats and its degrees of freedom, of a rig's batches; or between all recordings."""
    of_rig = [b for b, one in batches.items() if one.rig == batches[batch].rig]
    groups = {b: _groups(batches[b], parameters, channel, values) for b in of_rig}
    sd, freedom = pooled_scatter([group for of_batch in groups.values() for group in of_batch], relative=False)
    if freedom:
        return max(sd, pooled_scatter(groups[batch], relative=False)[0]), freedom
    return pooled_scatter([[v for group in of_batch for v in group] for of_batch in groups.values()], relative=False)


def _groups(batch: BatchAccuracy, parameters: str, channel: str, values: Values) -> list[list[float]]:
    """Values of the repeats of each condition."""
    one = batch.sets[parameters].channels.get(channel) if parameters in batch.sets else None
    groups: dict[str, list[float]] = {}
    for name, value in zip(batch.recordings, values(one) if one else (), strict=False):
        if value is not None:
            groups.setdefault(without_repeat(name), []).append(value)
    return list(groups.values())


def _log_errors(one: ChannelAccuracy) -> list[float | None]:
    return [None if error is None else float(np.log(max(error, 1e-6))) for error in one.errors]


def _numbers(values: Sequence[float | None]) -> np.ndarray:
    return np.array([value for value in values if value is not None])


def _range(value: float, reach: float | None) -> tuple[float | None, float | None]:
    if reach is None or reach > WIDE:
        return None, None
    return float(value * np.exp(-reach)), float(value * np.exp(reach))


def _less(accepted: Batches, now: Batches) -> Iterator[str]:
    """What was compared before and is not any more."""
    for batch, before in accepted.items():
        after = now.get(batch)
        if after is None:
            yield f"batch {batch}: accepted with {len(before.recordings)} recordings, and not compared in this run"
            continue
        for name, window in before.recordings.items():
            if (shorter := _shorter(window, after.recordings.get(name))) is not None:
                yield f"batch {batch}, recording {name}: {shorter}"
        for parameters, one in before.sets.items():
            if parameters not in after.sets:
                yield f"batch {batch}: {parameters} parameters are not compared in this run"
                continue
            yield from _fewer(batch, parameters, one.channels, before, after)


def _unknown(accepted: Batches, now: Batches) -> Iterator[str]:
    """What the baseline does not have: batches, and sets or channels of batches that it has."""
    advice = "the baseline does not have it; accept it once its accuracy is right"
    for batch, after in now.items():
        if batch not in accepted:
            yield f"batch {batch}: {advice}"
            continue
        before = set(_channels(accepted[batch]))
        for parameters, one in after.sets.items():
            if parameters not in accepted[batch].sets:
                yield f"batch {batch}, {parameters} parameters: {advice}"
            elif new := [symbol_of(c) for c in one.channels if (parameters, c) not in before]:
                yield f"batch {batch}, {', '.join(new)} with {parameters} parameters: {advice}"


def _fewer(
    batch: str, parameters: str, channels: Mapping[str, ChannelAccuracy], before: BatchAccuracy, after: BatchAccuracy
) -> Iterator[str]:
    """Channels of a set that are compared on fewer recordings."""
    for channel, one in channels.items():
        other = after.sets[parameters].channels.get(channel)
        names = {n for n, e in zip(before.recordings, one.errors, strict=True) if e is not None}
        still = {n for n, e in zip(after.recordings, other.errors, strict=True) if e is not None} if other else set()
        # A recording that is gone altogether has a line of its own.
        if gone := sorted((names - still) & after.recordings.keys()):
            what = f"batch {batch}, {symbol_of(channel)} with {parameters} parameters"
            yield f"{what}: not compared any more in {', '.join(gone)}"


def _shorter(before: Sequence[float], after: Sequence[float] | None) -> str | None:
    """How the compared part of a recording is shorter or ends earlier than accepted; None if it does not."""
    if after is None or after[2] == 0:
        return None if before[2] == 0 else "compared before, and not in this run"
    length = before[1] - before[0]
    if after[1] - after[0] < (1 - SHORTER) * length or after[1] < before[1] - SHORTER * length:
        return f"compared from {after[0]:g} to {after[1]:g} s, accepted from {before[0]:g} to {before[1]:g} s"
    if after[2] < (1 - SHORTER) * before[2]:
        return f"compared in {after[2]:g} samples, accepted in {before[2]:g}"
    return None


def _rank(verdict: str) -> int:
    return VERDICTS.get(verdict.partition(":")[0], 0)


def _channels(batch: BatchAccuracy) -> list[tuple[str, str]]:
    return [(parameters, channel) for parameters, one in batch.sets.items() for channel in one.channels]
