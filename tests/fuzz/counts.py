"""How the readers took the damaged files of this run, by reader."""

from collections import Counter

COUNTS: dict[str, Counter[str]] = {}
