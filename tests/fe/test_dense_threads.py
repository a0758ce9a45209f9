"""The limit of BLAS threads ends with the last block, in whatever order blocks of threads end."""

import numpy as np
import scipy.linalg
from threadpoolctl import ThreadpoolController, threadpool_limits

from carrierflex.fe.dense_threads import one_dense_thread


def n_threads():
    assert np.isfinite(scipy.linalg.norm(np.eye(2)))
    controllers = ThreadpoolController().select(internal_api="openblas").lib_controllers
    return {library.num_threads for library in controllers}


def test_blocks_that_overlap_restore_what_the_first_met():
    with threadpool_limits(2):
        before = n_threads()
        first, second = one_dense_thread(), one_dense_thread()
        first.__enter__()
        second.__enter__()
        first.__exit__(None, None, None)
        assert n_threads() == {1}
        second.__exit__(None, None, None)
        assert n_threads() == before
        assert 2 in before
