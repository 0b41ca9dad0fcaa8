"""Numbers that the thesis prints, beside which ours are put (L. Jia, TU Delft 2023)."""

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
