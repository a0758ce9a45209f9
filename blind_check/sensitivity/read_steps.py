"""In which steps between the records of an element and its answer a constant is read."""

from dataclasses import dataclass

from carrierflex.blind_check.sensitivity.listed_constants import Constant

#: Limits that the table reads, and those that the held-out squares read beside it; the decision
#: alone reads every other one.
OF_TABLE = ("n_folds", "fewest_blocks", "separable_from_drive")
OF_SCORES = ("ridges", "pair_ridges", "jitter")
_CLASSES = "diagnosis.element.classes."
_SIGNALS = "identification.campaign.signals"
_RECORDS = "diagnosis.element.records"
_LINEAR = "diagnosis.element.linear"
#: Holds weights of the penalties, as the first of `OF_SCORES` does.
_LIMITS = _CLASSES + "limits"
_ANSWER = _CLASSES + "answer"
_FLOOR = _CLASSES + "floor"
_LOOPS = _CLASSES + "smooth_loops"
#: Read by columns, and by nothing before them.
_COLUMNS = (
    _CLASSES + "columns",
    _CLASSES + "laws",
    "diagnosis.classes.memory_columns",
    "diagnosis.classes.splines",
)
_STARTS = _CLASSES + "starting_states"
_WEIGHTING = _CLASSES + "weighting"
_NOISE_COLOUR = _CLASSES + "noise_colour"
_TABLE = _CLASSES + "table"
_TIME = _CLASSES + "drive_in_time"


@dataclass(frozen=True, eq=False)
class Reads:
    """Steps that read a constant.

    Parameters
    ----------
    constant : Constant
        Which.
    """

    constant: Constant

    @property
    def is_of_problem(self) -> bool:
        """Records, or scale and noise of the element."""
        return self.constant.module in (_SIGNALS, _RECORDS, _LINEAR)

    @property
    def only_records(self) -> bool:
        """Records and no other step."""
        return self.constant.module == _RECORDS

    @property
    def is_behind_problem(self) -> bool:
        """A step behind records and scale."""
        return self.constant.module not in (_RECORDS, _LINEAR)

    @property
    def is_of_scores(self) -> bool:
        """Held-out squares, but for their folds."""
        return self.constant.module == _LIMITS or (
            self.constant.is_field and self.constant.name in OF_SCORES
        )

    @property
    def is_of_folds(self) -> bool:
        """Folds of the blocks."""
        return self.constant.is_field and self.constant.name == "n_folds"

    @property
    def is_of_floor(self) -> bool:
        """Whether the noise of the records is believed."""
        return self.constant.module == _FLOOR

    @property
    def is_of_loops(self) -> bool:
        """Smooth loops, which the decision asks for."""
        return self.constant.module == _LOOPS

    @property
    def is_of_answer_alone(self) -> bool:
        """Held-out squares or decision, and no step before them."""
        is_limit = self.constant.is_field and self.constant.name not in OF_TABLE
        return is_limit or self.constant.module in (_LIMITS, _ANSWER, _LOOPS)

    @property
    def is_of_answer(self) -> bool:
        """Decision, or the folds of its held-out squares."""
        of_time = self.constant.name == "separable_from_drive" or self.constant.module == _TIME
        return of_time or self.is_of_folds or self.is_of_answer_alone

    @property
    def is_of_counted(self) -> bool:
        """Runs in force space, or which of their samples count."""
        later = (*_COLUMNS, _STARTS, _WEIGHTING, _NOISE_COLOUR, _FLOOR)
        return self.constant.module not in later

    @property
    def is_of_weights(self) -> bool:
        """What the filters of the runs are set to."""
        return self.is_of_problem or self.constant.module in (_WEIGHTING, _NOISE_COLOUR, _TABLE)

    @property
    def is_of_filter(self) -> bool:
        """The filter itself."""
        return self.constant.module in (_SIGNALS, _WEIGHTING)

    @property
    def is_of_columns(self) -> bool:
        """Bases and columns, or where memories start; of signals they read the filter alone."""
        return self.constant.module in (*_COLUMNS, _STARTS, _TIME, _TABLE)
