"""Every threshold of the diagnosis in one place, with its reason."""

from dataclasses import dataclass

#: Quantiles of the draws that bound every 95 % interval.
INTERVAL = (0.025, 0.975)


@dataclass(frozen=True)
class Thresholds:
    """Limits of the verdicts and of the search.

    Where each of them decides: docs/diagnosis_method.md.
    """

    #: At the floor: held-out mean square of the baseline over the floor. Null runs of kind element
    #: with declared noise stay below 1.05; noise known to 5 % adds another 10 %.
    floor_ratio: float = 1.15
    #: The same where the floor itself is estimated from the record
    floor_ratio_estimated: float = 1.5
    #: Mean square over that of white noise as dense as the top of the spectrum that noise may have:
    #: an RMS of three, which no colour of a sensor's noise exceeds
    most_coloured: float = 9.0
    #: An effect belongs to a set only where it explains this share of the gap left without it: a
    #: smaller share is a remainder, not a cause
    explained: float = 0.5
    #: Beside others, an effect belongs to a set where it explains this share of the whole gap above
    #: the floor: below a tenth of the amplitude, what the law of the larger effect gets wrong may
    #: look like another effect
    material: float = 0.01
    #: stands_out, clears: A smaller effect belongs to a set too where what is left without it is
    #: this many times the RMS of the floor and the effect explains this share of that: an error in
    #: the form of a law is not the form of another law
    stands_out: float = 2.0
    clears: float = 0.9
    #: A set is named only where it explains this share of the gap above the floor. True effects of
    #: the library explain more than 0.9 even where their law differs in form; a one-sided spring
    #: passes for a quadratic one at 0.6.
    named_share: float = 0.7
    near_floor: float = 1.15  # RMS left over the floor up to which laws leave no more than noise
    remainder: float = 1.25  # RMS left over the floor above which a remainder is reported
    #: An effect whose signature keeps less than this beside the baseline cannot be seen at all
    surviving_share: float = 0.05
    #: Aliased where the other effect reproduces the fitted one up to this many floors
    exchange_ratio: float = 2.0
    equal_rms: float = 1.05  # Held-out RMS within this ratio counts as equal
    #: Draws of every interval: enough for the 2.5 % quantile to be within half a per cent
    bootstrap_samples: int = 1000
    seed: int = 0  # Of these draws; no verdict may hang on it
    #: An effect belongs to a set only where it reduces the held-out RMS in this share of the
    #: bootstrap samples: the upper end of the two-sided 95 % interval of the ratio is below one
    draws_that_reduce: float = 0.975
    #: RMS ratio of a bootstrap sample that holds none of the conditions in which an effect acts:
    #: one, but for how shared parameters shift
    unchanged: float = 1.001
    fewest_segments: int = 4  # Fewer segments of the record carry no held-out score
    fewest_samples: int = 200  # Fewer samples a run carry no diagnosis
