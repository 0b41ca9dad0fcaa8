"""What is shown of a model beside logs, of two fits, and of what a feedforward is worth."""

from __future__ import annotations

from identify.output.blocks import Block, Sentence, blocks_of, sentences
from identify.output.numbers import by_how_much, quantity
from identify.output.words.fit import (
    LOOPS,
    agreement_in_words,
    causes_in_words,
    correlation_in_words,
    difference_in_words,
    region_in_words,
)
from identify.output.words.recording import read_otherwise_in_words
from identify.results.results import Comparison, Feedforward
from identify.validation.agreement import Agreement
from identify.validation.comparison import AxisComparison


@blocks_of.register
def comparison_blocks(result: Comparison) -> list[Block]:
    """Errors by log, and the three worst regions of each axis."""
    blocks = sentences(read_otherwise_in_words(result.recording))
    for axis, c in result.axes.items():
        words, several = c.units.words, len(c.force_error) > 1
        *others, last = (
            f"axis {axis}, {name}: {words('force error')} {quantity(error, c.units.force)} "
            f"({error / c.floor:.1f} times the noise floor){_position_error(c, name)}"
            for name, error in c.force_error.items()
        )
        worst = "worst of all logs" if several else "worst"
        below = [f"{worst}: {region_in_words(region)}" for region in c.worst]
        below = below or ["in no region is the error above the noise"]
        tests = (words(correlation_in_words(test)) for test in c.tests.correlations)
        blocks += [*sentences(others), Sentence.over(last, (*below, *tests))]
    loops = dict.fromkeys(c.units.words(LOOPS[c.tests.loop]) for c in result.axes.values())
    return blocks + sentences(loops)


def _position_error(c: AxisComparison, log: str) -> str:
    """The position error of a log, as the rest of a sentence; nothing of imposed motion."""
    if log not in c.position_error:
        return ""
    error = quantity(c.position_error[log], c.units.position)
    fit = f" (fit {100.0 * c.position_fit[log]:.4g} %, NRMSE)"
    return f", {c.units.words('free-running position error')} {error}{fit}"


@blocks_of.register
def agreement_blocks(result: Agreement) -> list[Block]:
    """By axis whether the fits agree, what differs, and what would make the difference."""
    blocks: list[Block] = []
    for axis, found in result.axes.items():
        differing = (difference_in_words(n, found.parameters[n]) for n in found.differing)
        below = (*differing, *causes_in_words(found))
        blocks.append(Sentence.over(agreement_in_words(axis, found), below))
    return blocks + sentences(
        f"axis {axis}: not compared, as it has no intervals" for axis in result.not_compared
    )


@blocks_of.register
def feedforward_blocks(result: Feedforward) -> list[Block]:
    """By axis the tracking errors in simulation, and what each effect gains."""
    blocks = sentences([f"in simulation, on the motion of {', '.join(result.logs)}"])
    for axis, found in result.axes.items():
        unit = result.model.axes[axis].units.position
        gains = [
            f"with all but {e}: RMS {by_how_much(gain, unit)}" for e, gain in found.gains.items()
        ]
        *others, last = (
            f"{name}: {quantity(e.rms, unit)}, {quantity(e.largest, unit)}"
            for name, e in found.by_feedforward.items()
        )
        lost = (f"not in it: {e}, {why}" for e, why in found.lost.items())
        below = (*others, Sentence.over(last, gains), *lost)
        blocks.append(Sentence.over(f"axis {axis}: tracking error, RMS and largest", below))
    return blocks
