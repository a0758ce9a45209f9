"""Every threshold of the diagnosis in one place, with its reason."""

from dataclasses import dataclass

#: Quantiles of the draws that bound every 95 % interval.
INTERVAL = (0.025, 0.975)


@dataclass(frozen=True)
class Thresholds:
    """Limits of the verdicts and of the search.

    Where each of them decides: docs/diagnosis_method.md.

    Parameters
    ----------
    floor_ratio : float
        At the floor: held-out mean square of the baseline over the floor. Null runs of kind element
        with declared noise stay below 1.05; noise known to 5 % adds another 10 %.
    floor_ratio_estimated : float
        The same where the floor itself is estimated from the record.
    most_coloured : float
        Mean square over that of white noise as dense as the top of the spectrum that noise may
        have: an RMS of three, which no colour of a sensor's noise exceeds.
    explained : float
        An effect belongs to a set only where it explains this share of the gap left without it: a
        smaller share is a remainder, not a cause.
    material : float
        Beside others, an effect belongs to a set where it explains this share of the whole gap
        above the floor: below a tenth of the amplitude, what the law of the larger effect gets
        wrong may look like another effect.
    stands_out, clears : float
        A smaller effect belongs to a set too where what is left without it is this many times the
        RMS of the floor and the effect explains this share of that: an error in the form of a law
        is not the form of another law.
    named_share : float
        A set is named only where it explains this share of the gap above the floor. True effects of
        the library explain more than 0.9 even where their law differs in form; a one-sided spring
        passes for a quadratic one at 0.6.
    near_floor : float
        RMS left over the floor up to which laws leave no more than noise.
    fold_consistency : float
        Largest difference of a parameter between folds, in its standard deviations over the folds.
    remainder : float
        RMS left over the floor above which a remainder is reported.
    surviving_share : float
        An effect whose signature keeps less than this beside the baseline cannot be seen at all.
    exchange_ratio : float
        Aliased where the other effect reproduces the fitted one up to this many floors.
    equal_rms : float
        Held-out RMS within this ratio counts as equal, whatever the standard error says.
    never_equal_rms : float
        Above this ratio of held-out RMS two sets are not equal, however much the score scatters
        over the segments.
    bootstrap_samples : int
        Draws of every interval: enough for the 2.5 % quantile to be within half a per cent.
    seed : int
        Of these draws; no verdict may hang on it.
    draws_that_reduce : float
        An effect belongs to a set only where it reduces the held-out RMS in this share of the
        bootstrap samples: the upper end of the two-sided 95 % interval of the ratio is below one.
    unchanged : float
        RMS ratio of a bootstrap sample that holds none of the conditions in which an effect acts:
        one, but for how shared parameters shift.
    fold_signal : float
        Beyond its error, a parameter may change between folds by as much as changes this share of
        the effect's signal: several effects may trade against one another in a fold.
    fewest_segments : int
        Fewer segments of the record carry no held-out score.
    fewest_samples : int
        Fewer samples a run carry no diagnosis.
    """

    floor_ratio: float = 1.15
    floor_ratio_estimated: float = 1.5
    most_coloured: float = 9.0
    explained: float = 0.5
    material: float = 0.01
    stands_out: float = 2.0
    clears: float = 0.9
    named_share: float = 0.7
    near_floor: float = 1.15
    fold_consistency: float = 3.0
    remainder: float = 1.25
    surviving_share: float = 0.05
    exchange_ratio: float = 2.0
    equal_rms: float = 1.05
    never_equal_rms: float = 1.25
    bootstrap_samples: int = 1000
    seed: int = 0
    draws_that_reduce: float = 0.975
    unchanged: float = 1.001
    fold_signal: float = 0.5
    fewest_segments: int = 4
    fewest_samples: int = 200
