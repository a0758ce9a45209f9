"""Every constant of the comparison of classes that can change a verdict, with its reason."""

from dataclasses import dataclass


@dataclass(frozen=True)
class ClassConstants:
    """Limits of the comparison of classes."""

    #: Parts of the blocks that are held out in turn: three quarters of the records fit every class,
    #: and each condition is in every fit
    n_folds: int = 4
    #: Weights of the penalties that the folds choose from, in units of a group's mean energy: from
    #: no smoothing beyond rounding to a curve that is all but straight
    ridges: tuple[float, ...] = (1e-8, 1e-6, 1e-4, 1e-2)
    #: Factors on the members' own weights in a pair, where the search of its weights begins: beside
    #: its partner a class meets less noise
    pair_ridges: tuple[float, ...] = (1e-2, 1.0)
    #: Ridge on every class column, in the same units: keeps what the baseline already holds (a
    #: straight line, a constant) from making the matrix singular
    jitter: float = 1e-10
    #: Share of the gap that a class may leave and be named: less than 45 % of its amplitude
    named_left: float = 0.2
    #: Share from which a class leads: it explains more than everything else together
    leading_share: float = 0.5
    #: Part of the floor by which a held-out square may exceed it and count as at the floor
    nothing_beyond: float = 0.15
    #: Held-out square of the baseline over the floor that counts as at the floor where no class
    #: learns anything: noise whose neighbours are correlated carries up to three times the density
    #: of white noise in the band of the motion
    coloured_ratio: float = 3.0
    nothing_learnt: float = 0.1  # Share of the gap that counts as nothing learnt
    #: Differences within so many standard errors over the blocks are none
    standard_errors: float = 2.0
    #: equal_left, most_equal_left: ratios of what two classes leave: equal up to the first; never
    #: equal beyond the second (an RMS of 1.25), whatever the blocks scatter
    equal_left: float = 1.1
    most_equal_left: float = 1.56
    #: least_left, floor_error: what a class leaves is never taken as less than the first share of
    #: the floor, and the second is added: a floor is known to 5 % at best, and ratios of less would
    #: be ratios of its error
    least_left: float = 0.02
    floor_error: float = 0.05
    least_gain: float = 0.01  # Share of the gap that a richer answer must gain to be worth a word
    #: Share of the gap that a second class must gain to be a cause beside the first: less than a
    #: sixth of the gap's amplitude is what the first class has in second order (the servo axis of
    #: EMPS, whose friction is known, gains 0.020 by a delay)
    second_cause: float = 0.025
    #: small_cause_takes, small_cause_gain, small_cause_errors: where the drive moves at many
    #: frequencies, a second class that gains less is a cause all the same if it takes the first
    #: share of what the first class leaves and the second of the gap, by so many standard errors of
    #: the ratio over the blocks: what a class has in second order another one takes in part only,
    #: or is less
    small_cause_takes: float = 0.67
    small_cause_gain: float = 0.0015
    small_cause_errors: float = 4.0
    gain_of_left: float = 0.5  # Share of what the first answer leaves that a richer one must take
    #: Share of what a class leaves that its size by block may take: friction that its own heat
    #: softens gives up 0.35 to 0.86, what keeps its size 0.24 at most from two floors on, the
    #: sloshing tank 0.04 and the servo axis of EMPS 0.03
    size_changes: float = 0.3
    #: R² of the drive's amplitude, or of its frequency, on the time splines above which a change
    #: with time is not separable from the drive (sweeps and decays 0.6 to 1.0; multisines, noise
    #: and steady sines below 0.1)
    separable_from_drive: float = 0.3
    #: Difference of shares up to which a law is not distinguishable from its class
    law_named: float = 0.01
    #: Share that a class must explain for its law to be named, where it does not reach the floor: a
    #: law leaves nothing but noise, and what its class leaves is no law's (friction that its own
    #: heat softens follows Coulomb's law as well as any friction, and both leave a tenth)
    law_explains: float = 0.97
    #: Share that a further parameter of a law must gain among laws, and a coupled class over the
    #: class of a law for the law to lose its name
    law_parameter: float = 0.005
    bootstrap_samples: int = 400  # Draws of the blocks for standard errors and intervals
    band_samples: int = 100  # Draws of the blocks for the band of a measured shape
    fewest_blocks: int = 8  # Fewer blocks carry no comparison: each fold must hold two at least
