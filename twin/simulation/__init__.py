"""The twin runs: the control loop, MuJoCo or point masses under it, and the log of an experiment.

It knows the machine model and MuJoCo; an experiment, which says what motion is wanted, does not.
"""
