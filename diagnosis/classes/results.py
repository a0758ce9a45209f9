"""What the comparison of classes says: the class of the missing effect, and the law in it."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Annotated

from carrierflex.diagnosis.comparison.problem import FloatArray
from carrierflex.simulation.laws import Law

#: No gap above the noise floor.
NOTHING = "nothing"
#: A class (or a pair) explains at least the share that names it.
NAMED_CLASS = "named"
#: A class explains the larger part of the gap, not all of what a cause would.
LEADING_CLASS = "leading"
#: A gap that no class explains.
NO_CLASS = "no_class"
#: The records hold nothing that could tell classes apart.
NOT_VISIBLE = "not_visible"

_Interval = tuple[float, float]


@dataclass(frozen=True, eq=False)
class BesideCurve:
    """Curve of another part beside that of a shape."""

    name: Annotated[str, "Part in words"]
    x: Annotated[FloatArray, "Abscissa and curve"]
    y: Annotated[FloatArray, "Abscissa and curve"]
    band: Annotated[FloatArray, "Its 95 % band"]


@dataclass(frozen=True, eq=False)
class MeasuredShape:
    """Curve that the records give for a class, over the range they visit; arrays of shape (n,)."""

    x: Annotated[FloatArray, "Abscissa and the measured curve"]
    y: Annotated[FloatArray, "Abscissa and the measured curve"]
    #: Shape (n, 2)
    band: Annotated[FloatArray, "Lower and upper end of the 95 % band over the blocks"]
    law: Annotated[
        FloatArray, "The nearest law along the same abscissa; empty where no law is drawn"
    ]
    labels: Annotated[tuple[str, str], "What x and y are, and their units"]
    units: Annotated[tuple[str, str], "What x and y are, and their units"]
    words: Annotated[str, "The curve in an engineer's words"]
    smooth: Annotated[FloatArray, "The curve without its steps at rest"]
    steps: Annotated[
        tuple[float, float],
        "Dry friction at positive and at negative speed, >= 0; zero where the abscissa is no speed",
    ]
    beside: Annotated[tuple[BesideCurve, ...], "Curves of other parts"] = ()
    name: Annotated[str, "What the curve is beside others, in words"] = "measured"


#: Begins the name of a measured shape of a class among the laws of the simulator.
MEASURED = "measured "
_SHARE_WORDS = (
    "Share of the gap above the floor that the class explains on held-out records; in a pair, the "
    "mean of what it explains alone and of what is lost without it: parts add up to the pair's "
    "share. No share of an answer is above one"
)


@dataclass(frozen=True, eq=False)
class ClassFinding:
    """One class of the answer, and the law in it."""

    id: Annotated[str, "Class"]
    share: Annotated[float, _SHARE_WORDS]
    share_ci95: Annotated[_Interval, _SHARE_WORDS]
    law: Annotated[str, "Nearest law of the library in this class; empty where it holds none"]
    law_share: Annotated[
        float, "Share of the gap above the floor that the nearest law explains on held-out records"
    ]
    law_named: Annotated[bool, "Whether the records cannot tell the law from the class"]
    shape: MeasuredShape | None = None  # Measured curve; None where the class has none
    measured_law: Law | None = None  # The shape as a law without name; None where it has none

    def part(self, fraction: float) -> "ClassFinding":
        """The same with a fraction of its shares."""
        low, high = self.share_ci95
        return replace(
            self,
            share=fraction * self.share,
            share_ci95=(fraction * low, fraction * high),
            law_share=fraction * self.law_share,
        )


@dataclass(frozen=True, eq=False)
class ClassAnswer:
    """Which class of effect the gap shows."""

    #: NOTHING, NAMED_CLASS, LEADING_CLASS, NO_CLASS or NOT_VISIBLE
    state: str
    #: One for a single cause, two for a pair; empty where no class is named
    classes: tuple[ClassFinding, ...]
    ties: tuple[tuple[str, ...], ...]  # Sets that the records cannot tell from the answer
    #: Share of every other class alone; of all of them where none is named
    rivals: Mapping[str, float]
    #: share, share_ci95: of the answer as one
    share: float
    share_ci95: _Interval
    learnable: float  # Share that the union of all classes, or the best pair, explains
    #: Classes of the best pair beside the answer; empty where none adds to it
    learnt_by: tuple[str, ...]
    law_share: float  # Share that the nearest laws explain together
    #: Classes that hold each law, the narrowest first
    classes_of_law: Mapping[str, tuple[str, ...]]
    note: str = ""  # What the records cannot say, as a sentence; empty where nothing
    #: How the best class changes its size in the course of the records, as a sentence: no law keeps
    #: up with it. Empty where it does not
    changes: str = ""
    best: tuple[str, ...] = ()  # Classes that explain the share, where none is named
    #: Measured shapes of these classes, or of named ones that held-out records do not support
    unsupported: Mapping[str, Law | None] = field(default_factory=dict)
    #: What to record so that the class shows, where these records hold causes only mixed
    experiment: str = ""
    #: Whether laws and classes are scored on the same signals and held-out records; otherwise
    #: classes are compared in force space and laws are simulated
    same_scores: bool = False
    law_sets: tuple[tuple[str, ...], ...] = ()  # Laws that are worth a fit in the simulator
    #: Further sets, one for each cause of a body that differs from its drawing
    causes: tuple[tuple[str, ...], ...] = ()
    #: Groups of laws of one class that differ only in what they follow, where the records cannot
    #: say what a class follows
    alike: tuple[tuple[str, ...], ...] = ()

    @property
    def ids(self) -> tuple[str, ...]:
        """Classes of the answer."""
        return tuple(finding.id for finding in self.classes)

    @property
    def shapes(self) -> tuple[Law, ...]:
        """Measured shapes of the classes as laws, supported or not."""
        supported = {one.id: one.measured_law for one in self.classes if one.measured_law}
        return tuple(
            replace(law, name=MEASURED + name)
            for name, law in {**self.unsupported, **supported}.items()
            if law is not None
        )

    @property
    def beyond_share(self) -> float:
        """Share of the gap that the answer leaves."""
        return min(max(1.0 - self.share, 0.0), 1.0)

    @property
    def beyond_learnable(self) -> float:
        """Share of the gap beyond the answer that some class could still learn."""
        return min(max(self.learnable - self.share, 0.0), self.beyond_share)
