"""The frequency response of a machine from its logs, and the plant that it shows.

``response`` estimates, ``plant`` reads mass, resonances and delay off the estimate, ``loop`` the
closed loop. Nothing of the model's effects is used, so that it can contradict them.
"""
