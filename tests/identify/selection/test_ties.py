"""Which of those that explain as much is named, and that a doubted one is not."""

from __future__ import annotations

from dataclasses import replace

from planted_logs import SLIDE, Ride, begun, few, having, logged

from identify.selection.search import search
from identify.selection.ties import with_ties

TRUE = having(replace(SLIDE, effects=()), "dahl", Fc=0.3, sigma0=300.0, sigma2=0.5)


def test_the_simpler_of_two_leads_unless_it_was_doubted() -> None:
    """One that was doubted and led again would be doubted again: the search would never end."""
    fit, dataset = begun(SLIDE, *({f"{i}": logged(TRUE, Ride(i, 5.0))} for i in (1, 2)))
    both = search(fit, dataset, few("lugre", "dahl"))
    found = replace(search(fit, dataset, few("lugre")), ranking=both.ranking)
    assert [s.change.name for s in with_ties(found).steps] == ["dahl"]
    doubted = replace(found, barred=frozenset({"dahl"}))
    assert [s.change.name for s in with_ties(doubted).steps] == ["lugre"]
