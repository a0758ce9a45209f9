"""Sensitivities as one self-describing HDF5 file."""

from collections.abc import Sequence
from pathlib import Path

import h5py

from carrierflex.files.whole_files import whole_file
from carrierflex.reduction.carrier_sensitivities import BodySensitivities

FORMAT = "carrierflex-sensitivities"
VERSION = 1
_UNITS = (
    "SI: m, kg, s, N, rad, Hz; a derivative is per unit of its cause (attributes value, unit of "
    "the group causes); first axis: causes in their order"
)
_MEANING = (
    "dK = T^T K' T, dM = T^T M' T and dG = G' T on the nominal basis T, kept as it is; G is the "
    "pilots' motion in the reduced coordinates, [I 0] for the nominal body"
)


def write_sensitivities(path: Path, bodies: Sequence[BodySensitivities]) -> None:
    """Write the sensitivities of several bodies, a group each.

    In each: ``causes`` (names, value, unit), ``K``, ``M``, ``labels`` of the nominal body, ``dK``,
    ``dM``, ``dG``, ``frequency`` and ``d_frequency`` [Hz], and by curve ``axial``, ``radial``
    [m per 1 kN m or per 1 N], ``d_axial``, ``d_radial`` at ``angle`` [rad].

    Raises
    ------
    OSError
        Where the folder cannot be written.
    """
    text = h5py.string_dtype("utf-8")
    with whole_file(path) as temporary, h5py.File(temporary, "w") as file:
        file.attrs.update({"format": FORMAT, "version": VERSION, "units": _UNITS})
        for body in bodies:
            group = file.create_group(body.name)
            group.attrs["meaning"] = _MEANING
            causes = group.create_group("causes")
            for key in ("name", "unit"):
                words = [getattr(cause, key) for cause in body.causes]
                causes.create_dataset(key, data=words, dtype=text)
            causes["value"] = [cause.value for cause in body.causes]
            group.create_dataset("labels", data=list(body.model.labels), dtype=text)
            group["K"], group["M"] = body.model.K, body.model.M
            for key in ("dK", "dM", "dG"):
                group.create_dataset(key, data=getattr(body, key), compression="gzip")
            group["frequency"] = body.frequencies.frequency
            group["d_frequency"] = body.frequencies.derivative
            for name, curve in body.curves.items():
                subgroup = group.create_group(name)
                subgroup.attrs["unit_load"] = curve.nominal.unit_load
                subgroup["angle"] = curve.nominal.angle
                subgroup["axial"], subgroup["radial"] = curve.nominal.axial, curve.nominal.radial
                subgroup["d_axial"], subgroup["d_radial"] = curve.axial, curve.radial
