"""How many small faults, put into lines drawn at random, the tests notice.

``faults``: draw lines and alter them. ``reach``: which tests run a line. ``noticed``: put a fault
into a copy of the project and run those tests; the figures.
"""
