"""The loop in a browser: every click a command of `twin`."""
