"""Every threshold of the diagnosis in one place, with its reason."""

from dataclasses import dataclass

#: Quantiles of the draws that bound every 95 % interval.
INTERVAL = (0.025, 0.975)


@dataclass(frozen=True)
class Thresholds:
    """Limits of the verdicts and of the search.

    See docs/diagnosis.md for the null runs they were set on.

    Parameters
    ----------
    floor_ratio : float
        At the floor: held-out mean square of the baseline over the floor. Null runs of kind element
        with declared noise stay below 1.05; noise known to 5 % adds another 10 %.
    floor_ratio_estimated : float
        The same where the floor itself is estimated from the record.
    coloured_ratio : float
        The same where a flexible model learns nothing of the gap: noise whose neighbours are
        correlated by a half carries, at low frequencies, three times the mean square of white noise
        of the declared size.
    nothing_learnt : float
        Largest share of the gap that counts as nothing learnt.
    explained : float
        An effect belongs to a set only where it explains this share of what is left without it: a
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
    named_share_beyond, gap_beyond_floor : float
        The same where what is left is `gap_beyond_floor` times the RMS of the floor or more: a law
        of the right form leaves nothing but noise, or less than 30 % of the gap's amplitude. A stop
        that acts on one side passes for backlash or a cubic spring at 0.72 to 0.90, dry friction of
        a real axis for Coulomb's at 0.93; right names of small gaps (0.77 and more) leave 1.08 at
        most.
    class_weight : float
        Stacking weight that the class of the named effect must hold.
    negative_control_share : float
        Nothing is named where a negative control reaches this share of the mean square that the
        named set explains. Negative controls of null runs scatter within 0.98 to 1.02; beside a
        large gap that the baseline extrapolates badly, within 0.92 to 1.00.
    wholly_explained : float
        A set that explains this share is named whatever a negative control does: with few
        conditions a further regressor may steady a baseline that extrapolates badly (by a third of
        the gap), and never leaves a hundredth.
    fold_consistency : float
        Largest difference of a parameter between folds, in its standard deviations over the folds.
    remainder : float
        RMS left over the floor above which a remainder is reported.
    black_box_share : float
        "None of these" where the best set explains less than this share of what a flexible model
        can learn.
    surviving_share : float
        An effect whose signature keeps less than this beside the baseline cannot be seen at all.
    keep_within : float
        The screen keeps every effect whose R² is within this of the best.
    keep_at_least : int
        The screen never keeps fewer effects.
    most_effects : int
        Largest set tried.
    alias_correlation : float
        Signatures correlated at least this much are put to the exchange test.
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
    nothing_left : float
        A set whose held-out mean square is within this ratio of the noise's leaves nothing for a
        further effect.
    far_behind : float
        A set whose held-out mean square is this many times that of the best of its size is not
        extended.
    least_step : float
        The joint search ends where the best set of a size explains less than this share of what the
        best of the size before leaves: with five causes of like size the first explains a fifth.
    fewest_channels : int
        Fewer channels allow no joint search: a sum of laws of one motion fits any curve, several
        causes are told apart by the pattern they make over channels.
    fold_signal : float
        Beyond its error, a parameter may change between folds by as much as changes this share of
        the effect's signal: several effects may trade against one another in a fold.
    separates : float
        A candidate experiment separates two sets where they would differ by more than this many
        noise floors: below one it tells no more than the records at hand.
    fewest_segments : int
        Fewer segments of the record carry no held-out score.
    fewest_samples : int
        Fewer samples a run carry no diagnosis.
    """

    floor_ratio: float = 1.15
    floor_ratio_estimated: float = 1.5
    coloured_ratio: float = 3.0
    nothing_learnt: float = 0.1
    explained: float = 0.5
    material: float = 0.01
    stands_out: float = 2.0
    clears: float = 0.9
    named_share: float = 0.7
    named_share_beyond: float = 0.91
    gap_beyond_floor: float = 1.15
    class_weight: float = 0.9
    negative_control_share: float = 0.25
    wholly_explained: float = 0.99
    fold_consistency: float = 3.0
    remainder: float = 1.25
    black_box_share: float = 0.7
    surviving_share: float = 0.05
    keep_within: float = 0.15
    keep_at_least: int = 4
    most_effects: int = 8
    alias_correlation: float = 0.7
    exchange_ratio: float = 2.0
    equal_rms: float = 1.05
    never_equal_rms: float = 1.25
    bootstrap_samples: int = 1000
    seed: int = 0
    draws_that_reduce: float = 0.975
    unchanged: float = 1.001
    nothing_left: float = 1.03
    far_behind: float = 10.0
    least_step: float = 0.2
    fewest_channels: int = 2
    fold_signal: float = 0.5
    separates: float = 1.0
    fewest_segments: int = 4
    fewest_samples: int = 200
