"""Which machine a trial makes: a name that makes the same machine again."""

from __future__ import annotations

import re
from collections.abc import Collection, Container
from dataclasses import dataclass

from twin.errors import InputError

NOTHING = "nothing"
_FORM = re.compile(
    r"(?P<effects>[a-z_+]+)@(?P<strength>[0-9.]+)/(?P<variation>[a-z]+)/(?P<seed>\d+)(?P<out>/out)?"
)


@dataclass(frozen=True)
class Case:
    """What is planted: effect names, their force over the noise floor, and the seed.

    variation: how machine and logs depart from the model besides. known: whether the planted
    effects stay in the catalogue of the analysis.
    """

    effects: tuple[str, ...]
    strength: float
    seed: int
    variation: str = "plain"
    known: bool = True

    def __str__(self) -> str:
        planted = "+".join(self.effects) or NOTHING
        out = "" if self.known else "/out"
        return f"{planted}@{self.strength:g}/{self.variation}/{self.seed}{out}"


def parse_case(text: str, effects: Container[str], variations: Collection[str]) -> Case:
    """The case of a name such as "cogging@5/bumps/17"; InputError for any other text.

    effects, variations: those there are.
    """
    found = _FORM.fullmatch(text)
    if found is None:
        raise InputError(
            f"case '{text:.60}': give EFFECT@STRENGTH/VARIATION/SEED as the self-test prints it, "
            f"such as {Case((), 0.0, 17)}"
        )
    names = () if found["effects"] == NOTHING else tuple(found["effects"].split("+"))
    for name in names:
        if name not in effects:
            raise InputError(f"case '{text:.60}': no effect '{name}'; `twin effects` lists them")
    if found["variation"] not in variations:
        raise InputError(
            f"case '{text:.60}': no variation '{found['variation']}'; there are "
            f"{', '.join(variations)}"
        )
    return Case(
        names, float(found["strength"]), int(found["seed"]), found["variation"], not found["out"]
    )
