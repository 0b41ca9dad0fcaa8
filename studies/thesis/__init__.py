"""The study of L. Jia, Friction Identification on the Gantry Stage (TU Delft 2023), on its twin.

One module a chapter: what is run, what is found of it, and how that is told.
"""
