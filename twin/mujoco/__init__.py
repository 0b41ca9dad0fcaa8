"""MuJoCo: the passive callback, and the bodies of MJCF and URDF files.

The laws are evaluated by ``twin.core``; this package only connects MuJoCo to it.
"""
