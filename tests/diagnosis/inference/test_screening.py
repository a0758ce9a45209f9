"""Flexible features in blocks of their own against the same features as columns of the screen."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.diagnosis.comparison.problem import BLACK_BOX, FeatureBlocks, Signatures
from carrierflex.diagnosis.inference.screening import explainable_fraction, screen

N_SEGMENTS = 8
N_SAMPLES = 40
N_CHANNELS = 3
N_FEATURES = 2


@pytest.fixture(scope="module")
def signatures():
    """The same records with the features as columns, and in blocks by channel."""
    rng = np.random.default_rng(5)
    plain = rng.standard_normal((N_SEGMENTS, N_CHANNELS, N_SAMPLES, 4))
    features = rng.standard_normal((N_SEGMENTS, N_CHANNELS, N_SAMPLES, N_FEATURES))
    # The target holds the baseline, one effect and a part of each channel's first feature.
    plain[..., 0] += plain[..., 1] + 0.3 * plain[..., 2] + 2.0 * features[..., 0]
    spread = np.zeros((N_SEGMENTS, N_CHANNELS, N_SAMPLES, N_CHANNELS * N_FEATURES))
    for c in range(N_CHANNELS):
        spread[:, c, :, c * N_FEATURES : (c + 1) * N_FEATURES] = features[:, c]
    columns = np.concatenate([plain, spread], axis=3)
    gram = np.einsum("kcip,kciq->kpq", columns, columns)
    owners = ("a", "b", *[BLACK_BOX] * (N_CHANNELS * N_FEATURES))
    dense = Signatures(gram, 1, owners, ((),) * len(owners))
    blocks = FeatureBlocks(
        np.einsum("kcip,kciq->kcpq", plain, features),
        np.einsum("kcip,kciq->kcpq", features, features),
    )
    return dense, Signatures(gram[:, :4, :4], 1, ("a", "b"), ((), ()), blocks)


def test_features_in_blocks_explain_what_they_do_as_columns(signatures):
    dense, blocks = signatures
    expected = explainable_fraction(dense)
    assert 0.5 < expected < 1.0
    assert_allclose(explainable_fraction(blocks), expected, rtol=1e-10)
    # Without what they share with the target they would explain less: the products count.
    blind = replace(blocks.features, cross=0.0 * blocks.features.cross)
    assert explainable_fraction(replace(blocks, features=blind)) < 0.5 * expected


def test_the_ranking_of_effects_does_not_see_the_features(signatures):
    for entry, expected in zip(*(screen(own).effects for own in signatures), strict=True):
        assert (entry.id, entry.surviving) == (expected.id, pytest.approx(expected.surviving))
        assert entry.r_squared == pytest.approx(expected.r_squared, rel=1e-12)


def test_products_of_every_fourth_segment_are_all_that_is_looked_at(signatures):
    _, blocks = signatures
    groups = [np.arange(N_SEGMENTS) % 4 == k for k in range(4)]
    summed = Signatures(
        np.array([blocks.gram[own].sum(axis=0) for own in groups]),
        blocks.n_base,
        blocks.effects,
        blocks.variants,
        FeatureBlocks(
            np.array([blocks.features.cross[own].sum(axis=0) for own in groups]),
            np.array([blocks.features.square[own].sum(axis=0) for own in groups]),
        ),
    )
    assert_allclose(explainable_fraction(summed), explainable_fraction(blocks), rtol=1e-12)
