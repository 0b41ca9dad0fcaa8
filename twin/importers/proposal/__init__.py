"""Which column of a file is which signal of an axis: its name's words, then the physics, proposed.

``lexicon`` holds the words, ``names`` reads a name by them, ``motion`` and ``courses`` ask the
numbers, ``axes`` and ``signals`` decide, ``text`` writes the map.
"""
