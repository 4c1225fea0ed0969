"""Effects of a virtual rig beyond Coulomb friction, elastic cables and ideal sensors: one file each, found by listing.

An effect that is not given is absent; `Effects()` is the ideal rig. The time loop that integrates them is
`virtualrig.effect_march`.
"""

import hashlib
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from pkgutil import iter_modules
from typing import TYPE_CHECKING, Any, TypeVar

from numba import njit
from pydantic import create_model

from virtualrig.effects.contract import Law, Twin
from virtualrig.strict import Strict


def _found() -> dict[str, Twin]:
    found: dict[str, Twin] = {}
    for module_info in iter_modules(__path__):
        module = import_module(f"{__name__}.{module_info.name}")
        for twin in (*getattr(module, "TWINS", ()), *filter(None, [getattr(module, "TWIN", None)])):
            if twin.name in found:
                raise ValueError(f"two effects of the virtual rig are called {twin.name}")
            found[twin.name] = twin
    return found


TWINS = _found()


def _fields(group: str) -> dict[str, Any]:
    """Every twin's fields of a group."""
    return {name: declared for twin in TWINS.values() for name, declared in twin.fields.get(group, {}).items()}


class _Declared(Strict):
    """Effects whose fields the twins declare; a type checker does not see them."""

    if TYPE_CHECKING:

        def __init__(self, **fields: Any) -> None: ...

        def __getattr__(self, name: str) -> Any: ...


PulleyEffects = create_model("PulleyEffects", __base__=_Declared, __doc__="Effects of one pulley.", **_fields("pulley"))
LoadEffects = create_model("LoadEffects", __base__=_Declared, __doc__="The load beyond its spring.", **_fields("load"))
SideSensors = create_model(
    "SideSensors", __base__=_Declared, __doc__="Faults of the sensors of one side.", **_fields("sensors")
)


class _Whole(_Declared):
    @property
    def are_in_the_motion(self) -> bool:
        """Whether any effect is present other than faults of sensors, which do not change the motion."""
        sensors = {name: getattr(self, name) for name in ("drive_sensors", "load_sensors")}
        return self != Effects(**sensors)


Effects = create_model(
    "Effects",
    __base__=_Whole,
    __doc__="Every effect of a rig.",
    drive_pulley=(PulleyEffects, PulleyEffects()),
    load_pulley=(PulleyEffects, PulleyEffects()),
    load=(LoadEffects, LoadEffects()),
    drive_sensors=(SideSensors, SideSensors()),
    load_sensors=(SideSensors, SideSensors()),
    **_fields("rig"),
)


def numbers(effects: Effects) -> dict[str, Any]:
    """Every twin's values in the time loop."""
    return {name: value for twin in TWINS.values() for name, value in twin.numbers(effects).items()}


def merged(parts: list[dict]) -> dict:
    """Nested settings as one; two effects may share a pulley or the sensors of a side, never a number."""
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


def laws(kind: str) -> list[Law]:
    """Every twin's law of a kind, "slow_friction" or "friction"."""
    return [law for twin in TWINS.values() if (law := getattr(twin, kind))]


def chained(kind: str) -> Callable[..., Any]:
    """One compiled function of every law of a kind, each applied to what the one before gives."""
    chain: Callable[..., Any] = njit(_as_it_is)
    for law in laws(kind):
        chain = _then(chain, law.value)
    return chain


def _as_it_is(p: Any, value: Any, *state: Any) -> Any:
    return value


def _then(first: Callable[..., Any], second: Callable[..., Any]) -> Callable[..., Any]:
    @njit
    def both(p: Any, value: Any, *state: Any) -> Any:
        return second(p, first(p, value, *state), *state)

    return both


Function = TypeVar("Function", bound=Callable[..., Any])


def cached(function: Function) -> Function:
    """Compile `function`, cached on disk until its own file or a twin's changes.

    numba checks the time stamp of the function's own file only, so its cached name carries a digest of the others.
    """
    digest = hashlib.sha256()
    for file in sorted(Path(__file__).parent.glob("*.py")):
        digest.update(file.name.encode() + b"\0" + file.read_bytes())
    function.__qualname__ += f"_{digest.hexdigest()[:16]}"
    compiled: Any = njit(cache=True, error_model="numpy")(function)  # called like the function
    return compiled
