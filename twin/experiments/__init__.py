"""Experiments: setpoint generators, kinds of experiment, named experiments, TOML.

A new kind is a class in ``kinds``, with its setpoint; ``twin.simulation`` runs it on a model.
"""
