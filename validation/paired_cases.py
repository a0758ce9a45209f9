"""Sealed campaigns for paired checks: written once, diagnosed by as many trees as wanted.

Every kind has its number of cases, spread over its families. The campaigns are exported without
their truth to ``OUT/campaigns/KIND-FAMILY-SEED/CASE``; labels, seals and the digest stay in
``OUT/truth/KIND``. ``OUT/campaigns/cases.jsonl`` lists the cases in an order whose every beginning
holds kinds and families in the same proportion.

    python -m validation.paired_cases --out OUT --workers 2 [--seed 61011]
"""

import argparse
import json
import shutil
from collections import Counter
from collections.abc import Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from multiprocessing import get_context
from pathlib import Path

from carrierflex.blind_check.case_plans import case_plans
from carrierflex.blind_check.labels import DECAYS, KINDS, CasePlan, Label
from carrierflex.blind_check.sealing.check import LABELS_FILE, sealed_check
from carrierflex.blind_check.truth.campaigns import write_case
from carrierflex.blind_check.truth.element.drives import DECAY, STRATUM
from carrierflex.files.json_files import save_json
from carrierflex.identification.estimation.single_thread import single_threaded

#: First seed of the published figures; kinds take the next ones.
SEED = 61011
_ORDER_OF_SEEDS = ("element", "carrier", "mounting")
#: Cases of each kind by family. Kind element draws its driven families in its own strata.
SIZES: Mapping[str, Mapping[str, int]] = {
    "element": {"driven": 460, DECAYS: 40},
    "carrier": {
        "single": 40,
        "pair": 20,
        "nothing": 36,
        "outside": 34,
        "stage": 20,
        "form": 160,
        "several": 40,
        "model": 40,
    },
    "mounting": {
        "single": 40,
        "pair": 20,
        "nothing": 36,
        "outside": 34,
        "form": 160,
        "several": 40,
    },
}
CASES_FILE = "cases.jsonl"


def _seed_of(kind: str, first: int) -> int:
    return first + _ORDER_OF_SEEDS.index(kind)


def paired_plans(kind: str, seed: int = SEED) -> tuple[CasePlan, ...]:
    """Plans of one kind, numbered through over its families.

    Parameters
    ----------
    kind : str
        Kind of campaign.
    seed : int
        First seed, that of elements.
    """
    plans: list[CasePlan] = []
    for family, count in SIZES[kind].items():
        drawn = case_plans(
            kind, count, _seed_of(kind, seed), () if family == "driven" else (family,)
        )
        first = len(plans) + 1
        plans += [replace(plan, number=first + k) for k, plan in enumerate(drawn)]
    return tuple(plans)


def family_of(plan: CasePlan) -> str:
    """Family of a plan; the free decays of an element are one whatever they hold."""
    return DECAYS if plan.drive == DECAY else plan.family


def balanced_order(plans: Sequence[CasePlan]) -> list[CasePlan]:
    """Order whose every beginning holds kinds, families and strata of drives in proportion.

    Parameters
    ----------
    plans : sequence of CasePlan
        Plans of all kinds.
    """
    groups = [(plan.kind, family_of(plan), STRATUM.get(plan.drive, "")) for plan in plans]
    sizes, counted = Counter(groups), Counter[tuple[str, str, str]]()
    shares = []
    for group in groups:
        counted[group] += 1
        shares.append((counted[group] - 0.5) / sizes[group])
    return [plans[k] for k in sorted(range(len(plans)), key=lambda k: (shares[k], k))]


def write_paired_cases(out: Path, workers: int, seed: int = SEED) -> None:
    """Write, seal and export the cases of every kind.

    Parameters
    ----------
    out : Path
        Folder; an interrupted one goes on.
    workers : int
        Processes.
    seed : int
        First seed.
    """
    by_kind = {kind: paired_plans(kind, seed) for kind in KINDS}
    _write_list([plan for plans in by_kind.values() for plan in plans], out / "campaigns")
    for kind, plans in by_kind.items():
        truth = out / "truth" / kind
        if (truth / LABELS_FILE).is_file():
            continue
        truth.mkdir(parents=True, exist_ok=True)
        with ProcessPoolExecutor(workers, mp_context=get_context("spawn")) as executor:
            sealed = sealed_check(
                plans,
                truth,
                _write_case,
                executor,
                check={"seed": _seed_of(kind, seed), "cases": dict(SIZES[kind])},
                note=lambda text, share: None,
            )
        for plan in plans:
            target = out / "campaigns" / _folder(plan)
            shutil.rmtree(target, ignore_errors=True)
            target.parent.mkdir(parents=True, exist_ok=True)
            shutil.move(sealed.campaign(plan.name), target)
        labels = {case: json.loads(label.text()) for case, label in sealed.labels.items()}
        save_json(truth / LABELS_FILE, labels)
        print(f"{kind}: {len(plans)} cases, digest {sealed.published.digest}", flush=True)


def _write_list(plans: Sequence[CasePlan], campaigns: Path) -> None:
    rows = [
        {
            "case": plan.name,
            "kind": plan.kind,
            "family": family_of(plan),
            "folder": _folder(plan),
        }
        for plan in balanced_order(plans)
    ]
    text = "".join(json.dumps(row) + "\n" for row in rows)
    campaigns.mkdir(parents=True, exist_ok=True)
    (campaigns / CASES_FILE).write_text(text, encoding="utf-8")


def _folder(plan: CasePlan) -> str:
    return f"{plan.kind}-{family_of(plan)}-{plan.seed}/{plan.name}"


def _write_case(plan: CasePlan, folder: Path) -> Label:
    with single_threaded():
        return write_case(plan, folder)


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, required=True, help="folder of campaigns and truth")
    parser.add_argument("--workers", type=int, default=1, help="processes; default: 1")
    parser.add_argument("--seed", type=int, default=SEED, help=f"first seed; default: {SEED}")
    arguments = parser.parse_args()
    write_paired_cases(arguments.out, arguments.workers, arguments.seed)


if __name__ == "__main__":
    main()
