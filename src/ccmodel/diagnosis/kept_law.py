"""A learned law as the file of a mechanism, to be reviewed and added to the list (docs/how-to/add-a-mechanism.md)."""

import re
from collections.abc import Mapping
from textwrap import fill

from ccmodel import mechanisms as registry
from ccmodel.channels import short_name
from ccmodel.diagnosis.candidate import CandidateFit
from ccmodel.diagnosis.laws import values_of
from ccmodel.mechanisms.contract import (
    BEARING_TORQUE,
    CABLE_STRETCH,
    END_STRETCH,
    LOAD,
    PULLEY_RADIUS,
    SENSOR_MAP,
    SLIDING_FRICTION,
)
from ccmodel.typed import InputError

LONGEST_NAME = 60
NAME = re.compile(r"[a-z][a-z0-9]*(-[a-z0-9]+)*")
# What a law of each slot is mistaken for, where no listed mechanism has a law of its argument.
LOOK_ALIKES = {
    SLIDING_FRICTION: "mu",
    CABLE_STRETCH: "K",
    END_STRETCH: "termination-compliance",
    BEARING_TORQUE: "pulley-friction",
    LOAD: "load-stiffening",
    PULLEY_RADIUS: "pulley-eccentricity",
    SENSOR_MAP: "load-cell-scale",
}


def check_name(name: str) -> None:
    """Raise `InputError` unless a new mechanism can have this name."""
    if NAME.fullmatch(name) is None or len(name) > LONGEST_NAME:
        wanted = f"at most {LONGEST_NAME} small letters, as in stick-in-seal"
        raise InputError(f"keep-law: {name!r} is no name of a mechanism: {wanted}")
    if name in registry.names() or name in registry.laws():
        raise InputError(f"keep-law: {name} is a mechanism already; take another name")


def file_of(name: str) -> str:
    """Name of the file of a mechanism."""
    return f"{name.replace('-', '_')}.py"


def mechanism_file(name: str, stated: Mapping, candidate: CandidateFit, batch: str) -> str:
    """Text of the file of a mechanism that acts as a law of a fitted candidate.

    Parameters
    ----------
    name : str
        Of the new mechanism.
    stated : mapping
        The law as diagnosis.json has it.
    candidate : CandidateFit
    batch : str
    """
    law = registry.laws()[stated["name"]]
    x, y = law.at_knots(values_of(candidate, law))
    nearest = stated["nearest_listed"]
    argument = stated["argument_is"]
    value = "1 + strength y(x)" if law.form.is_factor else "strength y(x)"
    text = [
        _title(stated),
        f"Equation: With y the values of `CURVE` over x, {argument} ({stated['argument_unit']}), the law is {value}: "
        f"{stated['curve_is']}. It is piecewise linear between the knots and constant beyond them. {_formula(stated)}",
        f"Signature: The errors are a function of {argument}.",
        f"Separated by: recordings in which {argument} changes while all else stays.",
        f"Source: learned by ccmodel from the batch {batch} with a confidence of {stated['confidence']:.2f}; author, "
        "title, journal and year of what explains it are to be put here. The method is that of Rasmussen and Williams, "
        "Gaussian Processes for Machine Learning, MIT Press, 2006, Section 4.2.",
    ]
    return _FILE.format(
        name=name,
        text="\n\n".join(fill(paragraph, width=116) for paragraph in text),
        law=law.name,
        place=law.place,
        curve="\n".join(f"        [{a!r}, {b!r}]," for a, b in zip(x.tolist(), y.tolist(), strict=True)),
        look_alike=nearest["name"] if nearest else LOOK_ALIKES[law.slot],
        depends_on_time=law.argument.depends_on_time,
        looks_ahead=law.looks_ahead,
    )


def _title(stated: Mapping) -> str:
    slot, argument = stated["slot"].replace("-", " "), stated["arguments"][0].replace("-", " ")
    is_of_one = stated["slot"] == SENSOR_MAP and stated["channel"] is not None
    of = f" of {short_name(stated['channel'])}" if is_of_one else ""
    return f"A law of the {slot}{of} by the {argument}."


def _formula(stated: Mapping) -> str:
    """The formula with its constants in a sentence, if there is one."""
    if stated["formula"] is None:
        return "No short formula stays in its band."
    constants = (f"{p['name']} = {p['value']:.4g} ({p['low']:.4g} to {p['high']:.4g})" for p in stated["parameters"])
    return f"The shortest formula in its band is {stated['formula']} with {', '.join(constants)}."


_FILE = '''"""{text}
"""

import numpy as np

from ccmodel.mechanisms.contract import Mechanism, Parameter
from ccmodel.mechanisms.learned import laws

LAW = laws()["{law}"]
# Argument and value at each knot; the strength is 1 in the recordings that it was learned from.
CURVE = np.array(
    [
{curve}
    ]
)
X, Y = CURVE.T
STRENGTH = Parameter("strength", "1", 0.1, 3.0, 1.0, "size, over that in the recordings it was learned from")

MECHANISM = Mechanism(
    name="{name}",
    text=__doc__,
    tex=r"\\mathrm{{strength}}\\cdot y(x)",
    sentence="a learned law acts with {{strength}} times its strength",
    places=("{place}",),
    parameters=(STRENGTH,),
    mistaken_for=("{look_alike}",),
    depends_on_time={depends_on_time},
    looks_ahead={looks_ahead},
    curves=(LAW.curve(X, Y, STRENGTH),),
    **LAW.acting(lambda values: (X, values["strength"] * Y)),
)
'''
