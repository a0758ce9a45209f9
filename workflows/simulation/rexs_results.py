"""Results of a stage's runs back into a copy of its REXS file."""

from collections.abc import Iterator
from pathlib import Path

from carrierflex.geometry.parameters import GearData
from carrierflex.simulation.rexs.planetary_stage import (
    PlanetaryStage,
    planetary_stage,
    planetary_stages,
)
from carrierflex.simulation.rexs.rexs_files import (
    read_rexs,
    refuse_foreign_model,
    write_with_load_cases,
)
from carrierflex.simulation.rexs.rexs_model import RexsModel
from carrierflex.simulation.rexs.stage_results import RunMeans


class RexsResults:
    """A REXS file and the means of the runs that go into a copy of it.

    Parameters
    ----------
    source : Path
        REXS file of the stage.
    folder : Path
        Folder that takes the copy, under the file's name.
    gear : GearData
        Gears of the case: they tell which planetary stage of the file is meant.

    Raises
    ------
    FileExistsError
        Where a file is in the way that this program did not write.
    ValueError
        Where the file is refused, or not one planetary stage of it has these gears.
    """

    def __init__(self, source: Path, folder: Path, gear: GearData) -> None:
        self._source, self._path, self._gear = source, folder / source.name, gear
        if self._path.resolve() == source.resolve():
            raise ValueError(f"--rexs is {source}, in the folder of --loads; expected another one")
        refuse_foreign_model(self._path)
        model = read_rexs(source)
        stages = list(_simple_stages(model))
        wanted = (gear.ring_teeth, gear.planet_teeth, gear.sun_teeth)
        alike = [stage for stage in stages if stage.teeth == wanted]
        if len(alike) != 1:
            numbers = "; ".join("/".join(map(str, stage.teeth)) for stage in stages) or "none"
            raise ValueError(
                f"--rexs is {source}, whose planetary stages have ring/planet/sun teeth {numbers}; "
                f"expected one with {'/'.join(map(str, wanted))}, as the case has"
            )
        self._stage = alike[0]
        self._runs: dict[str, RunMeans] = {}

    def means_of(self, run: str) -> RunMeans:
        """What takes the load columns of a run."""
        return self._runs.setdefault(run, RunMeans(self._stage))

    def write(self) -> None:
        """Write the copy, one load case a run."""
        cases = [(name, means.results(self._gear)) for name, means in self._runs.items()]
        write_with_load_cases(self._path, self._source, cases)


def _simple_stages(model: RexsModel) -> Iterator[PlanetaryStage]:
    """Planetary stages of the kind that is simulated; the error of the only one, if it is none."""
    components = planetary_stages(model)
    for component in components:
        try:
            yield planetary_stage(model, component)
        except ValueError:
            if len(components) == 1:
                raise
