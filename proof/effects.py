"""How an effect of the plan enters the virtual rig, in the rig's own form, and what a diagnosis may be asked about it.

Each function takes a size, what else was drawn, the place and the rig's load stiffness, and gives two dicts: what it
sets in `virtualrig.effects.Effects`, and its values under the names of the effects' list, as far as a value there means
the same as here. A spread of elements has no single presliding length, and no such value.
"""

from collections.abc import Callable, Mapping

Values = dict[str, float]
Entry = Callable[[float, Mapping[str, float], str, float], tuple[dict, Values]]

FULL_STROKE_RAD = 0.6


def _presliding(size, also, place, spring):
    root = also["spread"] ** 0.5
    return {"presliding": {"law": "iwan", "shortest_m": size / root, "longest_m": size * root}}, {}


def _stribeck(size, also, place, spring):
    # Another curve over speed than the list's, so that only the height of its peak can be compared.
    return {"stribeck": {"rise": size, "speed_m_per_s": also["vs"], "exponent": 1.0}}, {"a": size}


def _viscous(size, also, place, spring):
    return {"viscous_Ns_per_m2": size}, {"c": size}


def _load_dependent(size, also, place, spring):
    return {"load_dependent_friction": {"exponent": -size}}, {"n": -size}


def _drag(size, also, place, spring):
    return {"drag_N": size}, {"f0": size}


def _kink(size, also, place, spring):
    return {"kinks": [{"bend_rad": size, "place_share": also["s"]}]}, {"beta": size, "s": also["s"]}


def _running_in(size, also, place, spring):
    # One that goes with the way is of the rig's own form: it is drawn where the time constant comes out short.
    if also["tau"] < 10:
        return {"running_in": {"change": size, "over": "travel_m", "scale": also["travel_m"]}}, {}
    return {"running_in": {"change": size, "scale": also["tau"]}}, {"change": size, "tau": also["tau"]}


def _asymmetry(size, also, place, spring):
    return {"cable_asymmetry": {"friction_ratio": 1 + size}}, {"ratio": 1 + size, "K_ratio": 1.0}


def _relaxation(size, also, place, spring):
    half, root = size / 2, 10**0.5
    branches = [{"share": half, "time_constant_s": also["tau"] * f} for f in (1 / root, root)]
    return {"relaxation": branches}, {}


def _settling(size, also, place, spring):
    return {"strand_settling": {"tension_scale_N": size}}, {}


def _termination(size, also, place, spring):
    end = {"drive-end": "drive_m_per_N", "load-end": "load_m_per_N"}[place]
    return {"termination_compliance": {end: size}}, {"compliance": size}


def _conduit(size, also, place, spring):
    return {"conduit_compliance_m_per_N": size}, {"compliance": size}


def _pulley_friction(size, also, place, spring):
    friction = {"torque_Nm": size, "presliding_rad": also["presliding_rad"]}
    return {place.replace("-", "_"): {"friction": friction}}, {"friction_torque": size}


def _eccentricity(size, also, place, spring):
    eccentricity = {"share": size, "phase_rad": also["phase"]}
    return {place.replace("-", "_"): {"eccentricity": eccentricity}}, {"e": size, "psi": also["phase"]}


def _backlash(size, also, place, spring):
    return {"load": {"half_gap_rad": size}}, {"half_gap": size}


def _stiffening(size, also, place, spring):
    cubic = size * spring / FULL_STROKE_RAD**2
    return {"load": {"cubic_Nm_per_rad3": cubic}}, {"K3": cubic}


def _inertia(size, also, place, spring):
    return {"load": {"inertia_kg_m2": size}}, {"J": size}


def _hysteretic_load(size, also, place, spring):
    return {"hysteretic_load": {"torque_Nm": size, "angle_rad": also["angle_rad"]}}, {}


def _directional(size, also, place, spring):
    return {"directional_friction": {"bias": size}}, {}


def _positional(size, also, place, spring):
    wear = {"rise": size, "period_m": also["period_m"], "phase_rad": also["phase"]}
    return {"positional_friction": wear}, {}


def _runout(size, also, place, spring):
    fault = {"angle_runout_rad": size, "angle_runout_phase_rad": also["phase"]}
    return {place.replace("-", "_") + "s": fault}, {}


def _sensor(field: str, name: str | None) -> Entry:
    """A fault of one side's sensors that is one number."""

    def enters(size, also, place, spring):
        return {place.replace("-", "_") + "s": {field: size}}, {name: size} if name else {}

    return enters


ENTRIES: dict[str, Entry] = {
    "presliding": _presliding,
    "stribeck": _stribeck,
    "viscous-friction": _viscous,
    "load-dependent-friction": _load_dependent,
    "constant-drag": _drag,
    "kink": _kink,
    "running-in": _running_in,
    "cable-asymmetry": _asymmetry,
    "relaxation": _relaxation,
    "strand-settling": _settling,
    "termination-compliance": _termination,
    "conduit-compliance": _conduit,
    "pulley-friction": _pulley_friction,
    "pulley-eccentricity": _eccentricity,
    "backlash": _backlash,
    "load-stiffening": _stiffening,
    "load-inertia": _inertia,
    "torque-scale": _sensor("torque_gain", "gain"),
    "load-cell-scale": _sensor("load_cell_gain", "gain"),
    "load-cell-offset": _sensor("load_cell_offset_N", "offset"),
    "load-cell-drift": _sensor("load_cell_drift_N_per_s", "rate"),
    "load-cell-crosstalk": _sensor("load_cell_crosstalk", "crosstalk"),
    "time-skew": _sensor("delay_s", "delay"),
    "unlisted-hysteretic-load": _hysteretic_load,
    "unlisted-directional-friction": _directional,
    "unlisted-positional-friction": _positional,
    "unlisted-encoder-runout": _runout,
    "unlisted-torque-curvature": _sensor("torque_curvature_per_Nm2", None),
}


def merged(parts: list[dict]) -> dict:
    """Nested dicts as one; two effects may share a pulley or the sensors of a side, never a number."""
    whole: dict = {}
    for part in parts:
        for key, value in part.items():
            if isinstance(value, dict) and isinstance(whole.get(key), dict):
                whole[key] = merged([whole[key], value])
            elif key in whole:
                raise ValueError(f"two effects both set {key}")
            else:
                whole[key] = value
    return whole
