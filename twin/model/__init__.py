"""The machine model: axes with their effects and values, read from and written to TOML.

A model is frozen; ``with_effect`` and ``without`` give another one.
"""
