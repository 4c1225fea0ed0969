"""The runs of `against_dynamics`: every effect that changes the motion, alone, as the rig and the solver take it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from ccmodel.mechanisms.presliding import ELEMENTS, SPREAD, element_lengths
from ccmodel.mechanisms.stribeck import RENEWAL_M
from virtualrig.motion import Sine


@dataclass(frozen=True)
class Case:
    """One comparison.

    Attributes
    ----------
    name, text : str
        The effect, and its parameters for the table.
    effects : mapping
        Fields of `virtualrig.effects.Effects`.
    mechanisms : sequence of (str, str, mapping)
        Name, place and values of the solver's mechanisms.
    pretension_N, amplitude_rad, frequency_Hz : float
    """

    name: str
    text: str
    effects: Mapping = field(default_factory=dict)
    mechanisms: Sequence = ()
    pretension_N: float = 7.3
    amplitude_rad: float = 0.7
    frequency_Hz: float = 1.0

    @property
    def drive(self) -> Sine:
        """A rest, a start-up over a quarter of a cycle, and one and a quarter cycles."""
        return Sine(
            wave="sine",
            amplitude_rad=self.amplitude_rad,
            frequency_Hz=self.frequency_Hz,
            rest_s=0.02,
            start_up_cycles=0.25,
            cycles=1.25,
        )


def cases() -> list[Case]:
    """Every case, in the order of the table."""
    return [
        Case("none", "7.3 N"),
        Case("none", "3.5 N, 1 rad, slack in part", pretension_N=3.5, amplitude_rad=1.0),
        *_conduit_cases(),
        *_cable_cases(),
        *_end_cases(),
        *_pulley_and_load_cases(),
        *_stribeck_cases(),
    ]


def _case(name: str, place: str, text: str, effects: Mapping, values: Mapping, **run) -> Case:
    return Case(name, text, effects, [(name, place, values)], **run)


def _presliding(z0: float) -> Case:
    effects = {"presliding": {"law": "dahl", "length_m": z0}}
    return _case("presliding", "conduit", f"z0 {z0 * 1e6:g} um", effects, {"z0": z0})


def _elements(z0: float) -> Case:
    shortest, *_, longest = element_lengths(z0, SPREAD)
    effects = {"presliding": {"law": "iwan", "shortest_m": shortest, "longest_m": longest, "elements": ELEMENTS}}
    return _case("presliding", "conduit", f"z0 {z0 * 1e6:g} um, no creep", effects, {"z0": z0, "creep": 0.0})


def _viscous(c: float) -> Case:
    return _case("viscous-friction", "conduit", f"c {c:g} N s/m^2", {"viscous_Ns_per_m2": c}, {"c": c})


def _load_dependent(n: float) -> Case:
    effects = {"load_dependent_friction": {"exponent": n}}
    return _case("load-dependent-friction", "conduit", f"n {n:g}", effects, {"n": n})


def _kink(beta: float, s: float) -> Case:
    effects = {"kinks": [{"bend_rad": beta, "place_share": s}]}
    return _case("kink", "conduit", f"beta {beta:g} rad, s {s:g}", effects, {"beta": beta, "s": s})


def _conduit_cases() -> list[Case]:
    running_in = {"running_in": {"change": 0.3, "scale": 2.0}}
    return [
        *map(_presliding, (20e-6, 150e-6)),
        _elements(60e-6),
        *map(_viscous, (50.0, 400.0)),
        *map(_load_dependent, (-0.15, -0.35)),
        _case("constant-drag", "conduit", "f0 1 N", {"drag_N": 1.0}, {"f0": 1.0}),
        _kink(0.6, 0.5),
        _kink(1.2, 0.23),
        _case("running-in", "conduit", "change 30 %, tau 2 s", running_in, {"change": 0.3, "tau": 2.0}),
    ]


def _cable_cases() -> list[Case]:
    asymmetry = {"cable_asymmetry": {"friction_ratio": 1.3, "stiffness_ratio": 0.8}}
    relaxation = {"relaxation": [{"share": 0.15, "time_constant_s": 2.0}]}
    return [
        _case("cable-asymmetry", "cable", "mu 1.3, K 0.8", asymmetry, {"ratio": 1.3, "K_ratio": 0.8}),
        _case("relaxation", "cable", "r 15 %, tau 2 s", relaxation, {"r": 0.15, "tau": 2.0}),
        *map(_settling, (7.3, 3.5)),
    ]


def _settling(pretension_N: float) -> Case:
    effects = {"strand_settling": {"law": "exponential", "tension_scale_N": 2.0}}
    text = f"T_scale 2 N at {pretension_N:g} N"
    return _case("strand-settling", "cable", text, effects, {"T_scale": 2.0}, pretension_N=pretension_N)


def _termination(side: str) -> Case:
    effects = {"termination_compliance": {f"{side}_m_per_N": 60e-6}}
    return _case("termination-compliance", f"{side}-end", f"{side}, 60 um/N", effects, {"compliance": 60e-6})


def _conduit_compliance(c: float) -> Case:
    effects = {"conduit_compliance_m_per_N": c}
    return _case("conduit-compliance", "conduit", f"{c * 1e6:g} um/N", effects, {"compliance": c})


def _end_cases() -> list[Case]:
    return [*map(_termination, ("drive", "load")), *map(_conduit_compliance, (20e-6, 70e-6))]


def _eccentricity(side: str) -> Case:
    effects = {f"{side}_pulley": {"eccentricity": {"share": 0.06, "phase_rad": 0.7}}}
    text = f"{side}, e 6 %, psi 0.7 rad"
    return _case("pulley-eccentricity", f"{side}-pulley", text, effects, {"e": 0.06, "psi": 0.7})


def _pulley_and_load_cases() -> list[Case]:
    friction = {"load_pulley": {"friction": {"torque_Nm": 5e-3, "presliding_rad": 2e-3}}}
    cubic = {"load": {"cubic_Nm_per_rad3": 0.1}}
    inertia = {"load": {"inertia_kg_m2": 5e-4}}
    return [
        _case("pulley-friction", "load-pulley", "load, 5 mN m", friction, {"friction_torque": 5e-3}),
        *map(_eccentricity, ("drive", "load")),
        _case("backlash", "load-pulley", "2 deg", {"load": {"half_gap_rad": 0.035}}, {"half_gap": 0.035}),
        _case("load-stiffening", "load", "K3 0.1 N m/rad^3", cubic, {"K3": 0.1}),
        _case("load-inertia", "load", "J 5e-4 kg m^2", inertia, {"J": 5e-4, "zeta": 0.0}),
    ]


def _stribeck_cases() -> list[Case]:
    """Friction that falls with speed: first where the motion is unique, then where the rig itself chatters."""
    return [
        _stribeck(0.05, 2e-3),
        _stribeck(0.2, 2e-3),
        _stribeck(0.2, 1e-4),
        _stribeck(0.2, 2e-3, presliding_m=40e-6),
        _stribeck(0.2, 10e-3, presliding_m=40e-6),
        _stribeck(0.4, 2e-3),
        _stribeck(0.2, 10e-3),
        _stribeck(0.2, 2e-3, renewal_m=2.5e-8),
        _stribeck(0.2, 10e-3, renewal_m=2.5e-8),
    ]


def _stribeck(rise: float, speed: float, renewal_m: float = RENEWAL_M, presliding_m: float = 0.0) -> Case:
    """Friction that falls with speed (m/s), alone or with presliding; `renewal_m` is the rig's renewal length alone."""
    effects = {"stribeck": {"rise": rise, "speed_m_per_s": speed, "exponent": 2.0, "renewal_m": renewal_m}}
    mechanisms = [("stribeck", "conduit", {"a": rise, "vs": speed})]
    text = f"a {100 * rise:g} %, vs {1e3 * speed:g} mm/s"
    if presliding_m:
        effects["presliding"] = {"law": "dahl", "length_m": presliding_m}
        mechanisms.append(("presliding", "conduit", {"z0": presliding_m}))
        text += f", with presliding {1e6 * presliding_m:g} um"
    if renewal_m != RENEWAL_M:
        text += f", in the rig renewed over {1e6 * renewal_m:g} um"
    return Case("stribeck", text, effects, mechanisms)
