"""Text in two notations: plain for diagnosis.json and a terminal, HTML for the report."""

from collections.abc import Iterable
from dataclasses import dataclass

from markupsafe import Markup, escape


@dataclass(frozen=True)
class Phrase:
    """Part of a sentence.

    Parameters
    ----------
    plain : str
        Plain text, powers as ``torque^1.0``.
    markup : Markup
        HTML, powers raised; a template shows it by :meth:`__html__`.
    """

    plain: str
    markup: Markup

    def __html__(self) -> str:
        """HTML, not to be escaped again."""
        return str(self.markup)

    def __str__(self) -> str:
        """Plain text."""
        return self.plain

    def __bool__(self) -> bool:
        """Whether it says anything."""
        return bool(self.plain)

    def __add__(self, other: "Phrase | str") -> "Phrase":
        """Both one after the other."""
        after = other if isinstance(other, Phrase) else phrase(other)
        return Phrase(self.plain + after.plain, self.markup + after.markup)

    def capitalised(self) -> "Phrase":
        """The same with its first letter large; it begins with plain text."""
        return Phrase(
            self.plain[:1].upper() + self.plain[1:],
            self.markup[:1].upper() + self.markup[1:],
        )


def phrase(text: str) -> Phrase:
    """Plain text as a phrase."""
    return Phrase(text, escape(text))


def joined(separator: str, phrases: Iterable[Phrase]) -> Phrase:
    """Phrases that say anything, with a separator between them."""
    said = [part for part in phrases if part]
    return Phrase(
        separator.join(part.plain for part in said),
        Markup(separator).join(part.markup for part in said),
    )


def power(base: str, exponent: str) -> Phrase:
    """Power: ``torque^-0.5``."""
    raised = Markup("{}<sup>{}</sup>").format(base, exponent.replace("-", "−"))
    return Phrase(f"{base}^{exponent}", raised)


def in_scientific_notation(number: str) -> Phrase:
    """Number as Python writes it, its power of ten raised: ``5.80e-4``."""
    mantissa, _, exponent = number.partition("e")
    if not exponent:
        return phrase(number)
    raised = power("10", str(int(exponent))).markup
    return Phrase(number, Markup("{}·{}").format(mantissa, raised))


def unit_phrase(unit: str) -> Phrase:
    """Unit with its powers raised: ``N s^2/m^3``."""
    first, *others = unit.split("^")
    markup = escape(first)
    for part in others:
        rest = part.lstrip("-.0123456789")
        exponent = part[: len(part) - len(rest)]
        markup += Markup("<sup>{}</sup>{}").format(exponent.replace("-", "−"), rest)
    return Phrase(unit, markup)
