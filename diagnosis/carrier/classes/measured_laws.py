"""Measured laws of a carrier: from an answer by class to a law, from a law to an effect."""

from collections.abc import Mapping, Sequence
from functools import partial

import numpy as np

from carrierflex.diagnosis.carrier.classes.catalogue import UNDETERMINED
from carrierflex.diagnosis.carrier.records.sums import CarrierSums
from carrierflex.diagnosis.classes.results import ClassAnswer, ClassFinding
from carrierflex.diagnosis.classes.shape_decision import shape_of, way_of
from carrierflex.diagnosis.classes.shapes import SIZE, law_of_class, visited_range_warning
from carrierflex.diagnosis.comparison.problem import FloatArray
from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign_check.campaign_warning import CampaignWarning
from carrierflex.simulation.carrier.effect import Effect
from carrierflex.simulation.carrier.measured_laws.carrier_laws import law_signal, refuse_other_rig
from carrierflex.simulation.carrier.measured_laws.rim_patterns import LOADS_OF, RIM_PATTERNS
from carrierflex.simulation.carrier.rim import CarrierInputs, CarrierRig, RimSensor
from carrierflex.simulation.laws import Law, Wave

#: Units of the loads, in the order of the records' columns.
_UNITS: Mapping[str, str] = {"torque": "N m", "ntl_y": "N along y", "ntl_z": "N along z"}
#: Share of the largest load of a kind within which a load is that of the records: its ripple.
_RIPPLE = 0.02


def carrier_law_of_answer(answer: ClassAnswer, campaign: str, wanted: str | None = None) -> Law:
    """Measured shape of a class of the answer.

    Parameters
    ----------
    answer : ClassAnswer
        Answer by class.
    campaign : str
        Name of the campaign.
    wanted : str, optional
        Frame and pattern; default: those of the class of the largest share.

    Returns
    -------
    Law
        Its waves.

    Raises
    ------
    ValueError
        Where no class is named or leading, the answer has not the wanted one, it has no pattern at
        the rim, or the records do not tell what it follows.
    """
    names = {
        finding.id: shape_of(finding.id)
        for finding in answer.classes
        if shape_of(finding.id) in RIM_PATTERNS
    }
    # A class without pattern is refused by the list of all where the answer holds none.
    names = names or {pattern: pattern for pattern in RIM_PATTERNS}
    return law_of_class(answer, campaign, names, wanted, _refusal)


def _refusal(name: str, finding: ClassFinding) -> str:
    """Why a class with a pattern has no law."""
    if way_of(finding.id) != UNDETERMINED:
        return ""
    return f"the records do not tell what '{name}' follows; expected three torques or more"


def effects_of_laws(laws: Sequence[Law], campaign: Campaign) -> tuple[Effect, ...]:
    """Effects of measured laws: one parameter, the size, one where the shape is as measured.

    Parameters
    ----------
    laws : sequence of Law
        Laws.
    campaign : Campaign
        Records that they are a candidate for.

    Raises
    ------
    ValueError
        Where a law is of another rig.
    """
    for law in laws:
        refuse_other_rig(law, int(campaign.rig["n_planets"]), float(campaign.rig["sensor_radius"]))
    return tuple(map(_effect_of, laws))


def _effect_of(law: Law) -> Effect:
    follows = " and ".join(own.replace("_", " ") for own in _followed(law))
    return Effect(
        law.name,
        equation=f"size x measured tables of {law.effect_class}, which follows {follows}",
        parameters=(SIZE,),
        signature="that of its tables",
        pattern=partial(_signals, law),
    )


def _followed(law: Law) -> tuple[str, ...]:
    """What its waves follow, each once."""
    return tuple(dict.fromkeys(wave.follows for wave in law.of(Wave)))


def _signals(law: Law, sensor: RimSensor, inputs: CarrierInputs, rig: CarrierRig) -> FloatArray:
    """Signal of a law of size one, shape (1, n)."""
    return law_signal(law, sensor, inputs)[None]


def beyond_visited(
    law: Law, records: CarrierSums, runs: Sequence[str]
) -> tuple[CampaignWarning, ...]:
    """Warning where records leave the loads at which a law was measured; empty where none does.

    Parameters
    ----------
    law : Law
        Law.
    records : CarrierSums
        Loads of every revolution.
    runs : sequence of str
        Names of the runs.
    """
    followed = {load for follows in _followed(law) for load in LOADS_OF[follows]}
    found: list[tuple[float, CampaignWarning]] = []
    for column, (load, unit) in enumerate(_UNITS.items()):
        if load not in followed:
            continue
        values, table = records.loads[:, column], np.array(law.visited[load])
        near = _RIPPLE * _largest(law, load)
        away = np.maximum(table[0] - values, values - table[1])
        share = float(np.mean(away > near))
        if share > 0.0:
            warning = visited_range_warning(
                law,
                share=share,
                reached=values,
                table=table,
                unit=unit,
                run=runs[int(records.run_of_revolution[np.argmax(away)])],
            )
            found.append((share, warning))
    return (max(found, key=lambda own: own[0])[1],) if found else ()


def _largest(law: Law, load: str) -> float:
    """Largest load of a kind in the records that gave a law."""
    alike = ("ntl_y", "ntl_z") if load != "torque" else ("torque",)
    return max(abs(end) for own in alike for end in law.visited[own])
