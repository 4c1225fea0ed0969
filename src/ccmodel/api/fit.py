"""Fits: the calibrated model of a batch, its values with their intervals."""

import json
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from html import escape
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pandas as pd

from ccmodel.api.batch import Batch, as_batch, check_consistent
from ccmodel.api.options import Tolerance, check_step, progress_of, settings_of
from ccmodel.api.recordings import counted
from ccmodel.diagnosis.run import Calibration, calibrate
from ccmodel.diagnosis.settings import GOOD_FIT
from ccmodel.distributions import student_quantile
from ccmodel.failure import ModelError
from ccmodel.inference.intervals import COVERAGE, Interval
from ccmodel.model.files import Model, RigConditions
from ccmodel.model.parameters import Parameters, unit_of_parameter
from ccmodel.outputs import new_file
from ccmodel.progress import Progress, within
from ccmodel.rig.consistency.fitted import contradicted_by_fit
from ccmodel.studies.diagnosis.run import INGEST, options_of
from ccmodel.typed import InputError

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True, eq=False, repr=False)
class Fit:
    """The paper's model, calibrated to a batch.

    Attributes
    ----------
    batch : Batch
    """

    batch: Batch
    _calibration: Calibration

    @property
    def values(self) -> dict[str, float]:
        """Fitted values by parameter, SI units."""
        return {name: self._calibration.fit.values[name] for name in self.intervals}

    @property
    def intervals(self) -> dict[str, Interval]:
        """The 90 % interval (``low``, ``high``) and standard deviation (``sd``) of each value, SI units.

        They follow from how the values change as each recording is left out (the jackknife), with Student's t of at
        most one degree of freedom less than recordings: 6.3 standard deviations to each side for two recordings. Of a
        single recording they follow from its noise.
        """
        return self._calibration.fit.intervals()

    @property
    def model(self) -> Model:
        """The fitted model, for `ccmodel.simulate` and `ccmodel.predict`."""
        intervals = {name: _finite(interval) for name, interval in self.intervals.items()}
        rig = RigConditions.of(self.batch.recordings)
        return Model(self._calibration.model, rig, intervals, dict(self.batch.provenance))

    @property
    def succeeded(self) -> bool:
        """Whether the search came to a minimum."""
        return self._calibration.fit.converged

    @property
    def message(self) -> str:
        """Why the search stopped."""
        return self._calibration.fit.message

    @property
    def mean_square(self) -> float:
        """Mean square of the leave-one-out residuals over their noise: 1 is noise, more is a model that errs."""
        return self._calibration.fit.mean_square

    @property
    def recordings(self) -> tuple[str, ...]:
        """Ids of the recordings that were fitted."""
        return tuple(w.observations.id for w in self._calibration.whitened)

    @property
    def at_bound(self) -> tuple[str, ...]:
        """Parameters that stand at one of their bounds: no values to rely on."""
        return tuple(self._calibration.fit.at_bounds())

    @property
    def warnings(self) -> tuple[str, ...]:
        """What speaks against relying on the values, a line each."""
        found = [] if self.succeeded else [f"no minimum was found: {self.message}"]
        if self.mean_square > GOOD_FIT:
            found.append(
                f"the model does not reproduce the recordings (mean square {self.mean_square:.3g}, 1 is noise): its"
                " values depend on the weights of the residuals, and the intervals do not include this;"
                " 'ccmodel diagnose' looks for what is missing"
            )
        wrong = contradicted_by_fit(self.model.parameters.stiffness_N_per_m, self.batch._file)
        found += [f"{finding.place}: {finding.text}" for finding in wrong]
        found += [f"{name} stands at one of its bounds" for name in self.at_bound]
        if len(self.recordings) == 1:
            found.append(
                "a single recording: intervals contain its noise alone, and not what differs between recordings"
            )
        return tuple(found)

    @property
    def notes(self) -> tuple[str, ...]:
        """What the recordings do not let a fit judge, a line each."""
        return tuple(f"{one['what']}: {one['why']}" for one in self._calibration.not_judged)

    def to_frame(self) -> pd.DataFrame:
        """A row for each parameter: ``value``, ``sd``, ``low``, ``high`` (90 % interval), ``unit``, ``at_bound``."""
        rows = {
            name: {
                "value": self.values[name],
                "sd": interval.sd,
                "low": interval.low,
                "high": interval.high,
                "unit": unit_of_parameter(name),
                "at_bound": name in self.at_bound,
            }
            for name, interval in self.intervals.items()
        }
        return pd.DataFrame.from_dict(rows, orient="index").rename_axis("parameter")

    @property
    def by_recording(self) -> pd.DataFrame:
        """What differs from recording to recording, a row for each: posterior means about the shared values, SI units.

        Columns are the recording's own ``friction_coefficient``, and the zeros of its sensors.
        """
        rows = {w.observations.id: w.own_values(self.values) for w in self._calibration.fit.whitened}
        return pd.DataFrame.from_dict(rows, orient="index").rename_axis("recording")

    @property
    def text(self) -> str:
        """The values with their intervals as text, without the warnings."""
        return "\n".join([self._title, self._shown.to_string(), *self._foot])

    def to_dict(self) -> dict[str, Any]:
        """Plain data: a model file with the intervals, and the fit's circumstances under the key ``fit``."""
        about = {
            "succeeded": self.succeeded,
            "message": self.message,
            "mean_square": self.mean_square,
            "recordings": list(self.recordings),
            "at_bound": list(self.at_bound),
        }
        return self.model.as_dict() | {"fit": about}

    def save(self, file: str | Path) -> None:
        """Write `to_dict` as JSON: a model file, which `ccmodel.read_model` and the commands of ``ccmodel`` read.

        Missing folders above it are made.

        Raises
        ------
        InputError
            If the file cannot be written.
        """
        with new_file(file) as path:
            path.write_text(json.dumps(self.to_dict(), indent=1, allow_nan=False) + "\n")

    def plot_residuals(self) -> "Figure":
        """Residuals (model minus recording) over the noise floor: a row for each channel, a column for each recording.

        Of a batch with many recordings, those with the largest residuals.
        """
        from ccmodel.api import figures

        return figures.residuals(self._calibration, self.batch)

    def __repr__(self) -> str:
        return "\n".join([self.text, *self._shown_warnings])

    def _repr_html_(self) -> str:
        lines = "".join(f"<li>{escape(line)}</li>" for line in self._shown_warnings)
        foot = f"<p>{'<br>'.join(self._foot)}</p>{f'<ul>{lines}</ul>' if lines else ''}"
        return f"<p>{escape(self._title)}</p>{self._shown.to_html(border=0)}{foot}"

    @property
    def _shown_warnings(self) -> list[str]:
        return [*(f"warning: {line}" for line in self.warnings), *(f"note: {line}" for line in self.notes)]

    @property
    def _title(self) -> str:
        return f"Fit of the paper's model to {self.batch.name}: {counted(len(self.recordings))}; {self.message}"

    @property
    def _foot(self) -> list[str]:
        mean_square = f"mean square of the held-out residuals over their noise: {self.mean_square:.3g} (1 is noise)"
        return [self._source_of_intervals, mean_square]

    @property
    def _source_of_intervals(self) -> str:
        """Where the intervals come from, and how far they reach at most."""
        fewest = float(self._calibration.fit.degrees_of_freedom.min())
        reach = f"{student_quantile(0.5 + COVERAGE / 2, fewest):.1f} standard deviations to each side"
        n = len(self.recordings)
        if n == 1:
            return f"90 % intervals: from the noise of the single recording, {reach}"
        freedom = f"{fewest:.2g} degree{'' if fewest == 1 else 's'} of freedom"
        return f"90 % intervals: Student's t of the jackknife over {n} recordings, {freedom}: up to {reach}"

    @property
    def _shown(self) -> pd.DataFrame:
        """The table as text."""
        frame = self.to_frame()
        ends = zip(frame["low"], frame["high"], strict=True)
        shown = {
            "value": frame["value"].map("{:.5g}".format),
            "standard deviation": frame["sd"].map("{:.2g}".format),
            "90 % interval": [f"{low:.5g} to {high:.5g}" for low, high in ends],
            "unit": frame["unit"],
            "at a bound?": frame["at_bound"].map({True: "yes", False: "no"}),
        }
        return pd.DataFrame(shown, index=frame.index).rename_axis(None)


def _finite(interval: Interval) -> Mapping[str, float | None]:
    """An interval as plain data; JSON has no infinite numbers."""
    ends = {"low": interval.low, "high": interval.high, "sd": interval.sd}
    return {name: value if isfinite(value) else None for name, value in ends.items()}


def fit(
    batch: Batch | str | Path,
    free: Collection[str] | None = None,
    *,
    tolerance: Tolerance | None = None,
    step_s: float | None = None,
    cycles: int | None = None,
    trust_inputs: bool = False,
    progress: bool | Progress = False,
) -> Fit:
    """Calibrate the paper's model to a batch: values with 90 % intervals.

    It is the calibration that a diagnosis begins with. Shared by all recordings are stiffness, friction coefficient,
    the load's spring, and whatever a rest does not show. What differs from recording to recording (friction by about
    1 %, sensor zeros, encoder offsets) has a prior and is marginalised. It is also the calibrated model of a diagnosis.
    The fit warns where it does not reproduce the recordings.

    Parameters
    ----------
    batch : Batch, str or Path
        A batch, or its folder.
    free : collection of str, optional
        Parameters that are fitted; the others keep the estimates of ``batch.yaml``. Without it, all that the recordings
        determine.
    tolerance : float or mapping of str to float, optional
        Standard deviation of a model error that counts as noise, as a share of a channel's peak to peak: one for all,
        or by channel.
    step_s : float, optional
        Least time between compared samples, s; without it, 0.008 s. At least a two-thousandth of a recording.
    cycles : int, optional
        Cycles of a sine that are compared, counted from the end of its start-up transient; without it, all.
    trust_inputs : bool
        Whether to fit even if the inputs contradict one another.
    progress : bool or callable
        True shows progress; a callable gets ``(text, share of the work done)``.

    Returns
    -------
    Fit
        Its table shows the values with their intervals.

    Raises
    ------
    InputError
        If the batch cannot be used, its inputs contradict one another, or `free` has a name that cannot be fitted.

    Examples
    --------
    >>> import ccmodel as cc
    >>> fit = cc.fit("data/raw/half-loop")
    >>> round(fit.values["stiffness_N_per_m"], -2)
    7500.0
    >>> interval = fit.intervals["friction_coefficient"]
    >>> interval.low < fit.values["friction_coefficient"] < interval.high
    True
    """
    options = options_of(settings_of(tolerance, step_s, cycles))
    names = [free] if isinstance(free, str) else free
    with progress_of(progress) as report:
        batch = as_batch(batch, within(report, 0.0, INGEST))
        check_step(batch.recordings, step_s)
        check_consistent(batch, trust_inputs)
        batch._ingested.check_usable(batch.folder)
        try:
            estimates = Parameters.estimated(batch._file.rig)
            found = calibrate(batch.recordings, estimates, options, progress=within(report, INGEST, 1.0), only=names)
        except (ModelError, ValueError) as error:
            raise InputError(f"{batch.folder}: {error}") from None
    return Fit(batch, found)
