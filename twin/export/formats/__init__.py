"""The exporters: every file in this folder is one format, and no other file names it."""
