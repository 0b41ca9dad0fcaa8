"""Studies made with the package, which do not travel with it."""
