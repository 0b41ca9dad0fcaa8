"""The one error that a user may cause; the command line prints it as a single line."""


class InputError(ValueError):
    """Input that cannot be used.

    The message is one line: what was given (with its unit), what is allowed, what to try.
    """
