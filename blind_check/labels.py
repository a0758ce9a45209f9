"""What is true of a case: the label that is sealed, and the plan it is made from."""

import json
import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

FAMILIES = ("single", "pair", "nothing", "outside", "aliased", "one_condition", "stage")
SINGLE, PAIR, NOTHING, OUTSIDE, ALIASED, ONE_CONDITION, STAGE = FAMILIES
#: Causes of the carrier in forms of no law, alone, in pairs and none: judged by class, and drawn
#: only where it is asked for.
FORM = "form"
#: Three to five such causes at once, each of a size of its own; drawn only where it is asked for.
SEVERAL = "several"
#: Carriers off their drawing, with another cause or none, and as drawn with any pin fit; drawn only
#: where it is asked for.
MODEL = "model"
#: Families whose causes have forms of no law.
FORM_FAMILIES = (FORM, SEVERAL)
#: Free decays of an element, which a smaller check holds only where they are asked for.
DECAYS = "decay"

KINDS = ("carrier", "mounting", "element")


@dataclass(frozen=True)
class CasePlan:
    """What a case is to hold, before its records are made.

    Parameters
    ----------
    kind : str
        Kind of campaign.
    number : int
        Place in the check, from 1; says nothing about the content.
    seed : int
        Seed of the whole check.
    family : str
        One of FAMILIES.
    effects : tuple of str
        Effects to withhold; for the family "outside" the name of a disturbance that no library
        holds. For kind element causes of the truth.
    ratio : float
        Wanted gap over the floor. Of several causes as if their signals had nothing in common.
    drive : str
        How an element is driven; empty for the other kinds.
    declares_noise : bool
        Whether the campaign declares the noise of its channels.
    own_ratios : tuple of float
        Of several causes, wanted gap over the floor of each alone.
    """

    kind: str
    number: int
    seed: int
    family: str
    effects: tuple[str, ...]
    ratio: float
    drive: str = ""
    declares_noise: bool = True
    own_ratios: tuple[float, ...] = ()

    @property
    def name(self) -> str:
        """Name of the case's folder."""
        return f"{self.kind}-{self.number:04d}"


@dataclass(frozen=True)
class Label:
    """The truth of a case.

    Parameters
    ----------
    case, kind, family : str
        Name, kind and family of the case.
    effects : tuple of str
        Withheld effects of the library.
    acceptable : tuple of tuple of str
        For each withheld effect, the ids that these records cannot tell from it, itself included.
    present : tuple of str
        Effects of the library that the disturbances amount to (errors of gain and angle of the
        sensors): naming them too is not wrong. Empty with nothing missing: there the disturbances
        leave at most 0.1 of the floor, and every name is false.
    gap_over_floor : float
        RMS of what the withheld effects leave after the baseline's own refit to all runs, over the
        RMS of the noise; of the cause in the family "outside". As planned, or less where the effect
        is at its physical limit.
    floor : float
        RMS of the noise, in the unit of the channels.
    rho : float
        Held-out RMS with the true effect taken out over that without, disturbances and noise
        included.
    parameters : mapping of str to mapping of str to float
        True values by effect and name, of the withheld effects and of the baseline.
    where : mapping of str to str or float
        Largest cell of the gap: ``run``; for the carrier also ``order`` and ``channel_pattern``.
        Of the family "model": ``beyond_drawing``, the gap over the floor that no pin fit of the
        drawing takes. Empty where the gap has none.
    classes : tuple of str
        Class ids of the withheld causes, sorted (kinds judged by class); empty where no class holds
        them.
    class_aliases : tuple of tuple of str
        Other sets of class ids, of a carrier of frames and patterns, that these records may not
        tell from `classes`.
    drive : str
        How an element is driven.
    changes : tuple of float
        Change of form of each cause, RMS over that of what the cause leaves.
    own_gaps : tuple of float
        Where several causes act, gap over the floor that each would leave alone.
    declares_noise : bool
        Whether the campaign declares the noise of its channels.
    """

    case: str
    kind: str
    family: str
    effects: tuple[str, ...]
    acceptable: tuple[tuple[str, ...], ...]
    present: tuple[str, ...]
    gap_over_floor: float
    floor: float
    rho: float
    parameters: Mapping[str, Mapping[str, float]]
    where: Mapping[str, Any]
    classes: tuple[str, ...] = ()
    class_aliases: tuple[tuple[str, ...], ...] = ()
    drive: str = ""
    changes: tuple[float, ...] = ()
    own_gaps: tuple[float, ...] = ()
    declares_noise: bool = True

    @property
    def has_no_class(self) -> bool:
        """Whether nothing is missing, or a cause that no class holds."""
        return self.family == NOTHING or (self.family == OUTSIDE and not self.classes)

    def text(self) -> str:
        """The label as JSON of one form only: what is sealed.

        Numbers keep six digits, so that another library version that rounds the last bits otherwise
        breaks no seal.
        """
        return json.dumps(
            _rounded(asdict(self)), sort_keys=True, separators=(",", ":"), allow_nan=False
        )

    @classmethod
    def from_text(cls, text: str) -> "Label":
        """Read what :meth:`text` wrote."""
        content = json.loads(text)
        return cls(
            **{
                **content,
                **{
                    name: tuple(content[name])
                    for name in ("effects", "present", "classes", "changes", "own_gaps")
                },
                **{
                    name: tuple(tuple(members) for members in content[name])
                    for name in ("acceptable", "class_aliases")
                },
            }
        )


def _rounded(value: Any) -> Any:
    if isinstance(value, dict):
        return {name: _rounded(item) for name, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_rounded(item) for item in value]
    if isinstance(value, float):
        # JSON knows no infinity: a ratio to a floor of zero is not known.
        return float(f"{value:.6g}") if math.isfinite(value) else None
    return value
