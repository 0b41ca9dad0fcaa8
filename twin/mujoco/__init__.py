"""MuJoCo: the passive callback, the MJCF model and the bodies that effects attach.

The laws are evaluated by ``twin.core``; this package only connects MuJoCo to it.
"""
