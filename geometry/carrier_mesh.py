"""The meshes the chain starts from: carrier without pins, carrier with bonded pins, one pin."""

from carrierflex.geometry.dihedral import completed, mirrored_pin
from carrierflex.geometry.half_sector import carrier_half_sector, pin_half
from carrierflex.geometry.named_surfaces import with_carrier_surfaces, with_pin_surfaces
from carrierflex.geometry.parameters import DEFAULT_SIZE, CarrierParameters, PinParameters
from carrierflex.geometry.quality import check_quality
from carrierflex.geometry.tet_mesh import TetMesh


def flexible_carrier_mesh(carrier: CarrierParameters, size: float = DEFAULT_SIZE) -> TetMesh:
    """Mesh the carrier with empty pin bores, the paper's flexible variant.

    Parameters
    ----------
    carrier : CarrierParameters
        Dimensions [m].
    size : float
        Edge length of the elements [m].

    Returns
    -------
    TetMesh
        The whole carrier with dihedral symmetry; body ``carrier`` and the surfaces of
        :func:`carrierflex.geometry.named_surfaces.with_carrier_surfaces`.

    Raises
    ------
    ValueError, MeshingError, InvertedElementError
        From meshing and from the quality check.
    """
    half = carrier_half_sector(carrier, size)
    check_quality(half)
    return with_carrier_surfaces(completed(half, carrier.n_planets), carrier)


def stiff_carrier_mesh(
    carrier: CarrierParameters, pin: PinParameters, size: float = DEFAULT_SIZE
) -> TetMesh:
    """Mesh the carrier with its pins bonded into the bores, the paper's stiff variant.

    Parameters, errors and result as in :func:`flexible_carrier_mesh`; with a second body ``pins``
    and the surfaces ``pin_i_midspan``.
    """
    half = carrier_half_sector(carrier, size, pin=pin)
    check_quality(half)
    return with_carrier_surfaces(completed(half, carrier.n_planets), carrier, pin)


def flexible_half_sector(carrier: CarrierParameters, size: float = DEFAULT_SIZE) -> TetMesh:
    """Mesh the half sector of :func:`flexible_carrier_mesh`, from a pin's plane to a web's.

    With the parts of the surfaces it holds.
    """
    half = carrier_half_sector(carrier, size)
    check_quality(half)
    return with_carrier_surfaces(half, carrier)


def stiff_half_sector(
    carrier: CarrierParameters, pin: PinParameters, size: float = DEFAULT_SIZE
) -> TetMesh:
    """Mesh the half sector of :func:`stiff_carrier_mesh`, from a pin's plane to a web's.

    With the parts of the surfaces it holds.
    """
    half = carrier_half_sector(carrier, size, pin=pin)
    check_quality(half)
    return with_carrier_surfaces(half, carrier, pin)


def pin_mesh(carrier: CarrierParameters, pin: PinParameters, size: float = DEFAULT_SIZE) -> TetMesh:
    """Mesh pin 1 alone, in the carrier's frame.

    Body ``pins``, surfaces ``pin_1_upwind``, ``_midspan``, ``_downwind``.
    """
    half = pin_half(carrier, pin, size)
    check_quality(half)
    return with_pin_surfaces(mirrored_pin(half), carrier, pin)
