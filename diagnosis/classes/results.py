"""What the comparison of classes says: the class of the missing effect, and the law in it."""

from collections.abc import Mapping
from dataclasses import dataclass

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

    name: str  # Part in words
    #: x, y: abscissa and curve, shape (n,)
    x: FloatArray
    y: FloatArray
    band: FloatArray  # Its 95 % band, shape (n, 2)


@dataclass(frozen=True, eq=False)
class MeasuredShape:
    """Curve that the records give for a class, over the range they visit."""

    #: x, y: abscissa and the measured curve, shape (n,)
    x: FloatArray
    y: FloatArray
    band: FloatArray  # Lower and upper end of the 95 % band over the blocks, shape (n, 2)
    #: The nearest law along the same abscissa; empty where no law is drawn, shape (n,)
    law: FloatArray
    #: labels, units: what x and y are, and their units
    labels: tuple[str, str]
    units: tuple[str, str]
    words: str  # The curve in an engineer's words
    smooth: FloatArray  # The curve without its steps at rest, shape (n,)
    #: Dry friction at positive and at negative speed, >= 0; zero where the abscissa is no speed
    steps: tuple[float, float]
    beside: tuple[BesideCurve, ...] = ()  # Curves of other parts
    name: str = "measured"  # What the curve is beside others, in words


@dataclass(frozen=True, eq=False)
class ClassFinding:
    """One class of the answer, and the law in it."""

    id: str  # Class
    #: share, share_ci95: share of the gap above the floor that the class explains on held-out
    #: records; in a pair, the mean of what it explains alone and of what is lost without it: parts
    #: add up to the pair's share. No share of an answer is above one
    share: float
    share_ci95: _Interval
    law: str  # Nearest law of the library in this class; empty where it holds none
    #: Share of the gap above the floor that the nearest law explains on held-out records
    law_share: float
    law_named: bool  # Whether the records cannot tell the law from the class
    shape: MeasuredShape | None = None  # Measured curve; None where the class has none
    #: Measured shape as a law without name; None where the class has none
    measured_law: Law | None = None


@dataclass(frozen=True, eq=False)
class ClassAnswer:
    """Which class of effect the gap shows."""

    #: One of :data:`NOTHING`, :data:`NAMED_CLASS`, :data:`LEADING_CLASS`, :data:`NO_CLASS`,
    #: :data:`NOT_VISIBLE`
    state: str
    #: One for a single cause, two for a pair; empty where no class is named
    classes: tuple[ClassFinding, ...]
    #: Sets of classes that the records cannot tell from the answer
    ties: tuple[tuple[str, ...], ...]
    #: Share of every other class alone; of all of them where none is named
    rivals: Mapping[str, float]
    #: share, share_ci95: share of the whole answer
    share: float
    share_ci95: _Interval
    learnable: float  # Share that the union of all classes, or the best pair, explains
    #: Classes of the best pair beside the answer; empty where none adds to it
    learnt_by: tuple[str, ...]
    law_share: float  # Share that the nearest laws explain together
    classes_of_law: Mapping[str, tuple[str, ...]]  # Classes that hold each law, the narrowest first
    note: str = ""  # What the records cannot say, as a sentence; empty where nothing
    best: tuple[str, ...] = ()  # Classes that explain the share, where none is named; else empty
    #: What to record so that the class shows, where these records hold causes only mixed; empty
    #: where nothing is asked
    experiment: str = ""
    #: Whether laws and classes are scored on the same signals and held-out records; otherwise
    #: classes are compared in force space and laws are simulated
    same_scores: bool = False
    law_sets: tuple[tuple[str, ...], ...] = ()  # Sets of laws that are worth a fit in the simulator
    #: Further sets, one for each cause of a body that differs from its drawing
    causes: tuple[tuple[str, ...], ...] = ()

    @property
    def ids(self) -> tuple[str, ...]:
        """Classes of the answer."""
        return tuple(finding.id for finding in self.classes)

    @property
    def beyond_share(self) -> float:
        """Share of the gap that the answer leaves."""
        return min(max(1.0 - self.share, 0.0), 1.0)

    @property
    def beyond_learnable(self) -> float:
        """Share of the gap beyond the answer that some class could still learn."""
        return min(max(self.learnable - self.share, 0.0), self.beyond_share)
