"""From a planet carrier's parameters to a diagnosed gap between simulation and measurement.

The folders of the repository are the stages of the method; an installed copy holds them below this
name: ``files``, ``geometry``, ``fe``, ``reduction``, ``simulation``, ``identification``,
``diagnosis``, ``blind_check``, ``workflows``.

``import carrierflex as cf`` offers the chain by the names below (docs/python.md); each is imported
when it is first asked for.
"""

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from carrierflex.workflows.in_python.bodies import Body, given_body, reduced_body
    from carrierflex.workflows.in_python.campaigns import (
        Records,
        measured_campaign,
        simulated_campaign,
    )
    from carrierflex.workflows.in_python.curves import Curves, deflection_curves
    from carrierflex.workflows.in_python.diagnoses import Diagnosed, diagnosed
    from carrierflex.workflows.in_python.plans import Planned, planned_campaign

__all__ = [
    "Body",
    "Curves",
    "Diagnosed",
    "Planned",
    "Records",
    "deflection_curves",
    "diagnosed",
    "given_body",
    "measured_campaign",
    "planned_campaign",
    "reduced_body",
    "simulated_campaign",
]

_MODULES = {
    "bodies": ("Body", "given_body", "reduced_body"),
    "campaigns": ("Records", "measured_campaign", "simulated_campaign"),
    "curves": ("Curves", "deflection_curves"),
    "diagnoses": ("Diagnosed", "diagnosed"),
    "plans": ("Planned", "planned_campaign"),
}


def __getattr__(name: str) -> Any:
    for module, names in _MODULES.items():
        if name in names:
            return getattr(
                importlib.import_module(f"carrierflex.workflows.in_python.{module}"), name
            )
    raise AttributeError(f"module 'carrierflex' has no attribute '{name}'")


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
