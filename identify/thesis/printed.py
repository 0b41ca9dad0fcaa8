"""Numbers that the thesis prints, beside which ours are put (L. Jia, TU Delft 2023).

And, for the twin of a machine in closed loop, those that the authors of the EMPS drive published.
"""

from __future__ import annotations

# Simulation study: means of 100 trials at 80 dB, in the parameters' SI units.
SIMULATION = {
    "Fc": 0.2850,
    "Fs": 0.3350,
    "v0": 0.0100,
    "sigma2": 0.0179,
    "sigma0": 259.9927,
    "sigma1": 0.6001,
}
ROLLER_PITCH = 34e-3  # m
# RMS of simulated less measured over measured, on the first record and on the one with pulses
# (A. Janot, M. Gautier, M. Brunot, Data Set and Reference Models of EMPS, 2019).
EMPS_CLOSED_LOOP = {
    "position": (1.375e-4, 8.0e-5),
    "velocity": (2.29e-3, 4.79e-3),
    "acceleration": (8.60e-2, 0.198),
    "force": (5.85e-2, 8.94e-2),
}
