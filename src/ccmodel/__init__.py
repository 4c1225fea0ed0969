"""Cable-conduit transmissions: recordings beside a distributed model, and the physics behind what differs.

The public interface is the names in `__all__`:

- `load` reads a folder of recordings into a `Batch` of `Recording`;
- `fit` calibrates the paper's model to it, and gives a `Fit` with an `Interval` of each value;
- `diagnose` decides whether that model explains the recordings, and gives a `Diagnosis`;
- `simulate` and `predict` run a `Model`, which a fit or a diagnosis has found or `read_model` reads from a file;
- `estimate` finds the load's torque and angle from the drive's side of a recording, and `compensate` the drive's motion
  for a wanted one of the load;
- `InputError` says in a line for each problem what cannot be used, and what to do.

Nothing else is needed for work with recordings, fits, diagnoses and models. All modules below (``ccmodel.model``,
``ccmodel.diagnosis`` and so on) are private and may change in any version. A name is loaded when it is first used:
``import ccmodel`` itself loads no library.
"""

from importlib import import_module

# As in `typing`, which takes longer to load than all else here.
TYPE_CHECKING = False
if TYPE_CHECKING:
    from ccmodel.api.batch import Batch, load
    from ccmodel.api.diagnosis import Diagnosis, diagnose
    from ccmodel.api.fit import Fit, fit
    from ccmodel.api.inverse import Compensation, Estimate, compensate, estimate
    from ccmodel.api.model import Model, Prediction, predict, read_model, simulate
    from ccmodel.inference.intervals import Interval
    from ccmodel.model.parameters import Parameters
    from ccmodel.progress import Progress
    from ccmodel.recording import Recording
    from ccmodel.rig.findings import Finding
    from ccmodel.typed import InputError
    from ccmodel.version import __version__

# Module of each public name.
_PLACES = {
    "Batch": "api.batch",
    "Compensation": "api.inverse",
    "Diagnosis": "api.diagnosis",
    "Estimate": "api.inverse",
    "Finding": "rig.findings",
    "Fit": "api.fit",
    "InputError": "typed",
    "Interval": "inference.intervals",
    "Model": "api.model",
    "Parameters": "model.parameters",
    "Prediction": "api.model",
    "Progress": "progress",
    "Recording": "recording",
    "__version__": "version",
    "compensate": "api.inverse",
    "diagnose": "api.diagnosis",
    "estimate": "api.inverse",
    "fit": "api.fit",
    "load": "api.batch",
    "predict": "api.model",
    "read_model": "api.model",
    "simulate": "api.model",
}

__all__ = [
    "Batch",
    "Compensation",
    "Diagnosis",
    "Estimate",
    "Finding",
    "Fit",
    "InputError",
    "Interval",
    "Model",
    "Parameters",
    "Prediction",
    "Progress",
    "Recording",
    "__version__",
    "compensate",
    "diagnose",
    "estimate",
    "fit",
    "load",
    "predict",
    "read_model",
    "simulate",
]


def _loaded(name: str) -> object:
    """A public name, loaded at its first use (PEP 562)."""
    if name not in _PLACES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value: object = getattr(import_module(f"{__name__}.{_PLACES[name]}"), name)
    globals()[name] = value
    return value


# A type checker knows the names from the imports above, and reports any other.
if not TYPE_CHECKING:
    __getattr__ = _loaded


def __dir__() -> list[str]:
    """The public names."""
    return sorted(__all__)
