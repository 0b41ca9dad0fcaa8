"""Validation of a model: misfit maps, free run, whiteness tests, error spectrum.

Nothing here chooses between models.
"""
