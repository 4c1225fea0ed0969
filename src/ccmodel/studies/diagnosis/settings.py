"""Settings of the diagnoses."""

from typing import Self

from pydantic import Field, model_validator

from ccmodel import mechanisms
from ccmodel.diagnosis.settings import MOST_MECHANISMS, RUN_LIMIT, TIME_LIMIT_S
from ccmodel.steps.settings import Tolerance
from ccmodel.typed import TypedModel

# Model file of each parameter set that a diagnosis gives; `nearest` is empty unless the verdict is unexplained.
MODEL_FILES = {"calibrated": "calibrated.json", "extended": "model.json", "nearest": "nearest.json"}


class Diagnosing(TypedModel):
    """How finely a diagnosis looks."""

    tolerance: Tolerance = Field(
        0.0,
        description="share of a channel's peak to peak that a right model may leave besides noise; or by channel",
    )
    step_s: float | None = Field(None, gt=0, description="compare a sample every so often, s; absent: finely")
    cycles: int | None = Field(None, ge=1, description="cycles of a sine that are compared once settled; absent: all")
    forced_candidates: list[list[str]] = Field(
        default_factory=list,
        description="one to four mechanisms each, 'name at place', to fit in full whatever the screening says",
    )
    run_limit: int = Field(
        RUN_LIMIT,
        gt=0,
        description="runs of the model after which no further candidate is fitted; the verdict says so",
    )
    time_limit_s: float = Field(
        TIME_LIMIT_S, gt=0, description="time after which no further candidate is fitted, s; the verdict says so"
    )
    trust_inputs: bool = Field(
        False, description="whether to diagnose even if the recordings contradict one another or batch.yaml"
    )

    @model_validator(mode="after")
    def _candidates_known(self) -> Self:
        for one in (one for candidate in self.forced_candidates for one in candidate):
            name, _, place = one.partition(" at ")
            if name not in mechanisms.names():
                raise ValueError(f"forced_candidates: there is no mechanism '{one}'; one is stated as 'name at place'")
            if place not in (places := mechanisms.get(name).places):
                stated = " or ".join(f"'{name} at {possible}'" for possible in places)
                raise ValueError(f"forced_candidates: '{one}' is at none of its places; state {stated}")
        if not all(1 <= len(candidate) <= MOST_MECHANISMS for candidate in self.forced_candidates):
            raise ValueError(f"forced_candidates: each is a list of one to {MOST_MECHANISMS} mechanisms")
        return self
