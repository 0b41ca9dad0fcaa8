"""Experiments: setpoint generators, kinds of experiment, named experiments, TOML.

A new kind is a class in ``kinds``; ``named.simulate`` runs any of them on a model.
"""
