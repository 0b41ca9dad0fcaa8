"""How a model fails: misfit maps, free run, whiteness, error spectrum.

Nothing here chooses between models.
"""
