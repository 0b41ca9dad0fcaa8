"""Curves read off logs without a fit of the whole model: friction by speed, the cable's force."""
