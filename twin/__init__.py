"""The machine: its effects, its model, its simulation, its experiments and its logs.

Data flow: effects -> model -> core -> mujoco and the reduced simulator -> log. Nothing here imports
``identify``.
"""
