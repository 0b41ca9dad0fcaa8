"""JSON of results as a strict reader gets it, and what fits and diagnoses have in common of it."""

import json

from identify.output.machine import plain


def strict(found):
    """The object after its way through text, which knows no NaN and no infinity."""

    def refuse(constant):
        raise AssertionError(f"{constant} is no JSON")

    return json.loads(json.dumps(plain(found)), parse_constant=refuse)


def expected_refit(changed):
    """What is said of the parameters that a fit moves."""
    return {
        "force_error_as_given": changed.given, "force_error": changed.refitted, "force_unit": "N",
        "changed": [
            {
                "parameter": c.label, "before": c.before, "after": c.after, "unit": c.unit,
                "force": c.force, "force_unit": "N", "same_force_as": list(c.alike),
            }
            for c in changed.changes
        ],
    }  # fmt: skip
