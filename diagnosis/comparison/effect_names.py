"""Effects in words: ids of the contract as an engineer would say them."""

from carrierflex.diagnosis.comparison.problem import Effects

_PROPER_NAMES = {
    "coulomb": "Coulomb",
    "stribeck": "Stribeck",
    "maxwell": "Maxwell",
    "dahl": "Dahl",
    "ntl": "non-torque-load",
}


#: Words of a line beside the shaft's orders by its frame, the first part of a class.
_LINES = {
    "nonsynchronous": "motion at {} beside the shaft's orders",
    "channel": "motion at {} in one sensor alone",
}


def plain_name(effect: str) -> str:
    """Effect id in words: ``cubic stiffness``, ``Coulomb friction``."""
    frame, _, line = effect.partition("/")
    if line and frame in _LINES:
        return _LINES[frame].format(line)
    words = effect.replace("elasto_plastic", "elasto-plastic").split("_")
    return " ".join(_PROPER_NAMES.get(word, word) for word in words)


def set_name(effects: Effects) -> str:
    """Set of effects in words; the empty one is the baseline."""
    return " + ".join(plain_name(effect) for effect in effects) or "baseline alone"
