"""The laws that every effect obeys, for the catalogue and for a user's own file.

Nothing here knows an effect by name or a parameter by its unit, so an effect added later is held to
the same laws. ``twin effects NAME --check`` runs them.
"""
