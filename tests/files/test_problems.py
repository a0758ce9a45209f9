"""Several things wrong with one input stay several wherever the error goes."""

import pickle

from carrierflex.files.problems import ProblemsError, problems_of


def test_problems_that_a_worker_found_are_told_as_it_found_them():
    """Errors of worker processes come as pickles, made anew of what `__reduce__` says."""
    error = ProblemsError(("first is wrong", "second is wrong"), "a.toml")
    unpickled = pickle.loads(pickle.dumps(error))
    assert (
        str(unpickled)
        == str(error)
        == "2 problems in a.toml: (1) first is wrong; (2) second is wrong"
    )
    assert problems_of(unpickled) == ("first is wrong", "second is wrong")
