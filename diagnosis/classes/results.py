"""What the comparison of classes says: the class of the missing effect, and the law in it."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

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
    """Curve of another part beside that of a shape.

    Parameters
    ----------
    name : str
        Part in words.
    x, y : ndarray, shape (n,)
        Abscissa and curve.
    band : ndarray, shape (n, 2)
        Its 95 % band.
    """

    name: str
    x: FloatArray
    y: FloatArray
    band: FloatArray


@dataclass(frozen=True, eq=False)
class MeasuredShape:
    """Curve that the records give for a class, over the range they visit.

    Parameters
    ----------
    x, y : ndarray, shape (n,)
        Abscissa and the measured curve.
    band : ndarray, shape (n, 2)
        Lower and upper end of the 95 % band over the blocks.
    law : ndarray, shape (n,)
        The nearest law along the same abscissa; empty where no law is drawn.
    labels, units : tuple of str
        What x and y are, and their units.
    words : str
        The curve in an engineer's words.
    smooth : ndarray, shape (n,)
        The curve without its steps at rest.
    steps : tuple of float
        Dry friction at positive and at negative speed, >= 0; zero where the abscissa is no speed.
    beside : tuple of BesideCurve
        Curves of other parts.
    name : str
        What the curve is beside others, in words.
    """

    x: FloatArray
    y: FloatArray
    band: FloatArray
    law: FloatArray
    labels: tuple[str, str]
    units: tuple[str, str]
    words: str
    smooth: FloatArray
    steps: tuple[float, float]
    beside: tuple[BesideCurve, ...] = ()
    name: str = "measured"


#: Begins the name of a measured shape of a class among the laws of the simulator.
MEASURED = "measured "


@dataclass(frozen=True, eq=False)
class ClassFinding:
    """One class of the answer, and the law in it.

    Parameters
    ----------
    id : str
        Class.
    share, share_ci95 : float, tuple of float
        Share of the gap above the floor that the class explains on held-out records; in a pair,
        the mean of what it explains alone and of what is lost without it: parts add up to the
        pair's share. No share of an answer is above one.
    law : str
        Nearest law of the library in this class; empty where it holds none.
    law_share : float
        Share of the gap above the floor that the nearest law explains on held-out records.
    law_named : bool
        Whether the records cannot tell the law from the class.
    shape : MeasuredShape, optional
        Measured curve; None where the class has none.
    measured_law : Law, optional
        Measured shape as a law without name; None where the class has none.
    """

    id: str
    share: float
    share_ci95: _Interval
    law: str
    law_share: float
    law_named: bool
    shape: MeasuredShape | None = None
    measured_law: Law | None = None


@dataclass(frozen=True, eq=False)
class ClassAnswer:
    """Which class of effect the gap shows.

    Parameters
    ----------
    state : str
        One of :data:`NOTHING`, :data:`NAMED_CLASS`, :data:`LEADING_CLASS`, :data:`NO_CLASS`,
        :data:`NOT_VISIBLE`.
    classes : tuple of ClassFinding
        One for a single cause, two for a pair; empty where no class is named.
    ties : tuple of tuple of str
        Sets of classes that the records cannot tell from the answer.
    rivals : mapping of str to float
        Share of every other class alone; of all of them where none is named.
    share, share_ci95 : float, tuple of float
        Share of the whole answer.
    learnable : float
        Share that the union of all classes, or the best pair, explains.
    learnt_by : tuple of str
        Classes of the best pair beside the answer; empty where none adds to it.
    law_share : float
        Share that the nearest laws explain together.
    classes_of_law : mapping of str to tuple of str
        Classes that hold each law, the narrowest first.
    note : str
        What the records cannot say, as a sentence; empty where nothing.
    best : tuple of str
        Classes that explain the share, where none is named; else empty.
    unsupported : mapping of str to Law
        Measured shapes of these classes, or of named ones that held-out records do not support.
    experiment : str
        What to record so that the class shows, where these records hold causes only mixed; empty
        where nothing is asked.
    same_scores : bool
        Whether laws and classes are scored on the same signals and held-out records; otherwise
        classes are compared in force space and laws are simulated.
    law_sets : tuple of tuple of str
        Sets of laws that are worth a fit in the simulator.
    causes : tuple of tuple of str
        Further sets, one for each cause of a body that differs from its drawing.
    alike : tuple of tuple of str
        Groups of laws of one class that differ only in what they follow, where the records cannot
        say what a class follows.
    """

    state: str
    classes: tuple[ClassFinding, ...]
    ties: tuple[tuple[str, ...], ...]
    rivals: Mapping[str, float]
    share: float
    share_ci95: _Interval
    learnable: float
    learnt_by: tuple[str, ...]
    law_share: float
    classes_of_law: Mapping[str, tuple[str, ...]]
    note: str = ""
    best: tuple[str, ...] = ()
    unsupported: Mapping[str, Law | None] = field(default_factory=dict)
    experiment: str = ""
    same_scores: bool = False
    law_sets: tuple[tuple[str, ...], ...] = ()
    causes: tuple[tuple[str, ...], ...] = ()
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
