"""MuJoCo: the passive callback, the MJCF model and the bodies that effects attach.

What a law computes is in ``twin.core``; here is only how MuJoCo is made to ask for it.
"""
