"""Bodies, rotors, gains, friction with load and springs of all joints, decided in one regression.

``groups``: what may be another than in the model, and its columns; ``regression``: the weak form of
all joints at once; ``choice``: which groups must move away from the file; ``bodies``: what is told
of a body, and what becomes of the model.
"""
