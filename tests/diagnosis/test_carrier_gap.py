import numpy as np
import pytest
from numpy.testing import assert_allclose

from diagnosis.carrier_gap import RADIAL, pattern_split
from diagnosis.order_map import MAX_ORDER
from identification.campaign import Channel
from tests.diagnosis.carrier_twin import CHANNELS, twin_plant


def cells_of(plant):
    return {(c.run, c.channel_pattern, int(c.order)): c for c in plant.gap_cells((), plant.starts((), {})[-1])}


@pytest.mark.parametrize(("order", "pattern"), [(2, "m=2"), (3, "m=-1"), (4, "m=0"), (5, "m=+1")])
def test_waviness_lands_only_in_m_equal_to_n_modulo_four(order, pattern):
    def waves(channel, angle):
        return 1e-4 * np.cos(order * (channel.angle - angle)) * (channel in CHANNELS[:4])

    cells = cells_of(twin_plant(None, extra=waves, turns=6))
    own = {m: cells["run1", m, order].coherent for m in ("m=0", "m=+1", "m=-1", "m=2")}
    # Four of six channels, half the squared amplitude; the rest is noise.
    assert_allclose(own.pop(pattern), 1e-8 / 2.0 * 4.0 / 6.0, rtol=0.01)
    assert max(own.values()) < 1e-4 * 1e-8


def test_a_gain_error_leaks_into_the_saddle_pattern_in_one_constant_ratio():
    orders = np.zeros((1, 4, MAX_ORDER + 1), dtype=complex)
    channels = CHANNELS[:4]
    for n, size in ((1, 1.0), (5, 0.3)):
        orders[0, :, n] = size * np.exp(-1j * n * np.array([channel.angle for channel in channels]))
    orders[0, 1] *= 1.05
    split = pattern_split(channels, orders)
    for n in (1, 5):
        forward, saddle = (split.amplitudes[0, split.names.index(m), MAX_ORDER + n] for m in ("m=+1", "m=2"))
        assert_allclose(abs(saddle / forward), 0.0125 / 1.0125, rtol=1e-12)


def test_radial_pair_tells_forward_from_backward_whirl():
    channels = CHANNELS[4:]
    orders = np.zeros((1, 2, MAX_ORDER + 1), dtype=complex)
    # u = exp(+j theta): a sensor at v reads cos(theta - v).
    orders[0, :, 1] = np.exp(-1j * np.array([channel.angle for channel in channels]))
    split = pattern_split(channels, orders)
    assert split.names == (RADIAL,)
    assert_allclose(split.amplitudes[0, 0, MAX_ORDER + 1], 1.0, rtol=1e-12)
    assert abs(split.amplitudes[0, 0, MAX_ORDER - 1]) < 1e-12


def test_channels_without_a_pattern_stand_alone():
    channels = (Channel("a", "axial_displacement", "m", 0.0, 0.4), Channel("b", "axial_displacement", "m", 2.0, 0.4))
    assert pattern_split(channels, np.zeros((1, 2, MAX_ORDER + 1), dtype=complex)).names == ("a", "b")


def test_the_sentence_names_frame_order_and_growth():
    plant = twin_plant("flexible_pins", contained=("axial_offset", "housing_tilt", "carrier_tilt"))
    text = plant.where_text((), plant.starts((), {})[-1])
    assert "order 3, m=-1 (waves fixed to the carrier), in every run, growing as torque^1.0" in text
    bare = twin_plant("carrier_tilt", contained=("axial_offset", "housing_tilt", "flexible_pins"))
    text = bare.where_text((), bare.starts((), {})[-1])
    assert "order 1, m=+1 (tilt fixed to the carrier), in every run, whatever the torque" in text


def test_without_a_gap_the_sentence_says_so():
    plant = twin_plant(None)
    assert "stands out" in plant.where_text((), plant.starts((), {})[-1])
