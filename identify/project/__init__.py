"""A project: a folder with recordings, models, answers and the commands that made them."""
