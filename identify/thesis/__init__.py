"""The thesis's study run on the twin, chapter by chapter; one module a chapter."""
