"""Body files come back whole.

Whatever else lies under the name is refused with an explanation, with the file's name.
"""

import h5py
import numpy as np
import pytest

from carrierflex.reduction.body_files import BodyFileError, read_body, write_body


@pytest.fixture
def written(tmp_path, pin_reduction):
    path = tmp_path / "pin.h5"
    write_body(pin_reduction.model, path)
    return path


def assert_same(read, model):
    for letter in ("K", "M", "D", "sensor_rows"):
        assert (getattr(read, letter) == getattr(model, letter)).all()
    assert (read.name, read.labels, read.sensor_names) == (
        model.name,
        model.labels,
        model.sensor_names,
    )
    assert list(read.pilots) == list(model.pilots)
    for name in model.pilots:
        assert (read.pilots[name] == model.pilots[name]).all()
        assert (read.pilot_coordinates[name] == model.pilot_coordinates[name]).all()
    assert read.mass_properties.mass == model.mass_properties.mass
    assert (read.mass_properties.centre == model.mass_properties.centre).all()
    assert (read.mass_properties.inertia == model.mass_properties.inertia).all()
    assert dict(read.provenance) == dict(model.provenance)


def test_a_body_comes_back_bit_by_bit(written, pin_reduction):
    assert_same(read_body(written), pin_reduction.model)


def test_a_body_with_sensors_and_provenance_comes_back(tmp_path, flexible_reduction):
    write_body(flexible_reduction.model, tmp_path / "carrier.h5")
    result = read_body(tmp_path / "carrier.h5")
    assert_same(result, flexible_reduction.model)
    assert result.provenance == {"mesh size": "0.06 m"}


def test_the_file_states_its_format_version_and_units(written):
    with h5py.File(written) as file:
        assert (file.attrs["format"], file.attrs["version"], file.attrs["name"]) == (
            "carrierflex-body",
            1,
            "pin",
        )
        assert file.attrs["units"].startswith("SI: m, kg, s, N, rad")


@pytest.mark.parametrize("version", [1.0 + 1.0j, np.nan, [1, 2], "one"])
def test_a_version_that_is_no_number_is_refused(written, version):
    with h5py.File(written, "r+") as file:
        file.attrs["version"] = version
    with pytest.raises(BodyFileError, match=r"attribute version of / is .*; expected one number"):
        read_body(written)


def test_a_newer_version_is_refused_in_words(written):
    with h5py.File(written, "r+") as file:
        file.attrs["version"] = 3
    with pytest.raises(
        BodyFileError, match=r"pin\.h5: written by a newer version \(file version 3, .* up to 2\)"
    ):
        read_body(written)


def test_another_format_is_refused(written):
    with h5py.File(written, "r+") as file:
        file.attrs["format"] = "somebody-else"
    with pytest.raises(
        BodyFileError, match=r"pin\.h5: format is 'somebody-else'; expected 'carrierflex-body'"
    ):
        read_body(written)


def test_an_empty_hdf5_file_is_refused(tmp_path):
    h5py.File(tmp_path / "empty.h5", "w").close()
    with pytest.raises(
        BodyFileError, match=r"empty\.h5: format is None; expected 'carrierflex-body'"
    ):
        read_body(tmp_path / "empty.h5")


@pytest.mark.parametrize("content", [b"", b"solid pin", b"\x89HDF\r\n\x1a\n"])
def test_a_file_that_is_not_hdf5_is_refused(tmp_path, content):
    (tmp_path / "pin.h5").write_bytes(content)
    with pytest.raises(
        BodyFileError, match=r"pin\.h5: not a complete body file \(.*\); expected HDF5 of format"
    ):
        read_body(tmp_path / "pin.h5")


@pytest.mark.parametrize("share", [0.1, 0.5, 0.9, 0.999])
def test_a_truncated_file_is_refused(written, share):
    content = written.read_bytes()
    written.write_bytes(content[: int(share * len(content))])
    with pytest.raises(BodyFileError, match=r"pin\.h5: not a complete body file \(.*truncated"):
        read_body(written)


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(
        FileNotFoundError, match=r"absent\.h5: no such file; expected a body file \(\.h5\)"
    ):
        read_body(tmp_path / "absent.h5")


@pytest.mark.parametrize(
    "name", ["K", "labels", "pilots/points", "sensors/rows", "mass_properties", "provenance"]
)
def test_a_missing_part_is_refused(written, name):
    with h5py.File(written, "r+") as file:
        del file[name]
    with pytest.raises(BodyFileError, match=r"pin\.h5: "):
        read_body(written)


def replaced(path, name, value):
    with h5py.File(path, "r+") as file:
        del file[name]
        file[name] = value


STRINGS = [f"coordinate {i}" for i in range(20_001)]
NAN = float("nan")
WRONG_PARTS = {
    "nan in K": ("K", np.full((22, 22), NAN), r"/K holds a value that is not finite"),
    "nan in mass": ("mass_properties/mass", NAN, r"mass.* not finite"),
    "mass of a list": ("mass_properties/mass", np.ones(2), r"pin\.h5"),
    "shape of M": ("M", np.eye(3), r"/M has shape \(3, 3\); expected \(22, 22\)"),
    "points": (
        "pilots/points",
        np.zeros((3, 2)),
        r"/pilots/points has shape \(3, 2\); expected \(3, 3\)",
    ),
    "coordinate too large": (
        "pilots/coordinates",
        np.full((3, 6), 22),
        r"a pilot refers to coordinate 22; expected numbers",
    ),
    "coordinate negative": (
        "pilots/coordinates",
        np.full((3, 6), -1),
        r"a pilot refers to coordinate",
    ),
    "too many labels": (
        "labels",
        STRINGS,
        r"/labels has shape \(20001,\); expected a list of at most 20000",
    ),
    "text in K": ("K", np.full((22, 22), b"x"), r"/K holds .*expected numbers"),
    "numbers for labels": ("labels", np.zeros(22), r"/labels holds .*; expected text"),
    "one word for labels": ("labels", "K", r"pin\.h5"),
    "pilots of one name": (
        "pilots/names",
        ["pin_1_upwind", "pin_1_upwind", "pin_1_downwind"],
        r"pin_1_upwind",
    ),
}


@pytest.mark.parametrize("kind", WRONG_PARTS)
def test_a_wrong_part_is_refused(written, kind):
    name, value, message = WRONG_PARTS[kind]
    replaced(written, name, value)
    with pytest.raises(
        BodyFileError, match=rf"pin\.h5: .*{message}" if "pin" not in message else message
    ):
        read_body(written)


def test_a_folder_where_a_matrix_should_be_is_refused(written):
    with h5py.File(written, "r+") as file:
        del file["K"]
        file.create_group("K")
    with pytest.raises(BodyFileError, match=r"pin\.h5"):
        read_body(written)


def test_a_matrix_that_promises_more_than_memory_is_refused_unread(written):
    with h5py.File(written, "r+") as file:
        del file["K"]
        file.create_dataset("K", shape=(10**7, 10**7), dtype="f8", chunks=(1024, 1024))
    with pytest.raises(
        BodyFileError, match=r"/K has shape \(10000000, 10000000\); expected \(22, 22\)"
    ):
        read_body(written)


def test_a_failed_write_leaves_the_old_file_and_nothing_else(written, pin_reduction, monkeypatch):
    before = written.read_bytes()

    def fail(file, model):
        file["K"] = model.K
        raise OSError("disk full")

    monkeypatch.setattr("carrierflex.reduction.body_files._fill", fail)
    with pytest.raises(OSError, match="disk full"):
        write_body(pin_reduction.model, written)
    assert [path.name for path in written.parent.iterdir()] == ["pin.h5"]
    assert written.read_bytes() == before


def test_a_missing_folder_is_an_error_of_the_system(tmp_path, pin_reduction):
    with pytest.raises(OSError, match="absent"):
        write_body(pin_reduction.model, tmp_path / "absent" / "pin.h5")


def changed(path, name, change):
    with h5py.File(path, "r+") as file:
        file[name][...] = change(file[name][...])


@pytest.mark.parametrize(
    ("name", "change", "reason"),
    [
        ("K", lambda K: K + np.triu(K, 1), r"K differs from its transpose"),
        ("M", lambda M: M + np.triu(M, 1), r"M differs from its transpose"),
        ("K", lambda K: -K, r"K, scaled to unit diagonal, has the eigenvalue -1"),
        ("M", lambda M: -M, r"M, scaled to unit diagonal, has the eigenvalue -1"),
        ("mass_properties/mass", lambda m: -m, r"mass is -[\d.]+ kg; expected a positive mass"),
        ("M", lambda M: 2.0 * M, r"M moved as a rigid body has the mass .* expected the same"),
    ],
)
def test_matrices_of_no_body_are_refused(written, name, change, reason):
    changed(written, name, change)
    with pytest.raises(BodyFileError, match=rf"pin\.h5: .*{reason}"):
        read_body(written)


@pytest.mark.parametrize(
    ("name", "dtype", "reason"),
    [
        # Declared and never written: 24 million numbers of no bytes.
        ("ffrf/Q", "f8", "states .* bytes and stores 0"),
        ("labels", "S50000000", "holds texts of 50000000 bytes; expected names"),
        ("mass_properties/centre", "S1500000000", "expected numbers"),
        ("K", h5py.string_dtype(), "expected numbers"),
    ],
)
def test_what_is_declared_and_not_stored_is_refused_unread(written, name, dtype, reason):
    n = 2000
    with h5py.File(written, "r+") as file:
        shapes = {"labels": (22,), "ffrf/Q": (6, n, n), "mass_properties/centre": (3,)}
        del file[name]
        file.create_dataset(name, shape=shapes.get(name, (22, 22)), dtype=dtype)
        if name == "ffrf/Q":
            for dataset, shape in {"labels": (n,), "K": (n, n)}.items():
                del file[dataset]
                if dataset == "labels":
                    file[dataset] = [f"mode {i}" for i in range(n)]
                else:
                    file.create_dataset(dataset, shape=shape, dtype="f8")
    with pytest.raises(BodyFileError, match=rf"pin\.h5: .*{reason}"):
        read_body(written)


@pytest.mark.parametrize("name", ["p0\nGRID,999,,1.,2.,3.", "\x1b]0;x", "n" * 501])
@pytest.mark.parametrize("dataset", ["pilots/names", "labels"])
def test_names_that_end_a_line_of_a_deck_are_refused(written, name, dataset):
    with h5py.File(written, "r+") as file:
        names = [name, *file[dataset].asstr()[1:]]
        del file[dataset]
        file[dataset] = names
    with pytest.raises(BodyFileError, match=rf"pin\.h5: .*/{dataset} holds the name"):
        read_body(written)


def test_a_list_of_one_long_text_is_not_multiplied(written):
    with h5py.File(written, "r+") as file:
        del file["labels"]
        file["labels"] = ["x" * 3_000_000] * 22
    with pytest.raises(BodyFileError, match="/labels holds the name 'xxx"):
        read_body(written)


def test_links_to_other_files_are_refused(written, tmp_path):
    with h5py.File(tmp_path / "other.h5", "w") as file:
        file["K"] = np.eye(22)
    with h5py.File(written, "r+") as file:
        del file["K"]
        file["K"] = h5py.ExternalLink(str(tmp_path / "other.h5"), "/K")
    with pytest.raises(BodyFileError, match="/K is missing or a link"):
        read_body(written)
