"""The machine moving as a log and a model say: in MuJoCo's viewer, a page, a video, Rerun.

Whatever shows it takes a ``Replay`` (what moved, with what force) and a ``Stage`` (what it looks
like).
"""
