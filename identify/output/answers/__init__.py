"""The JSON objects of commands: one class each, from which the JSON schema is made.

A field is read from the attribute of the result that has its name, or that ``read`` tells; arrays,
enums and what is no number are dealt with in ``answer``. Numbers are in SI units, beside their
units. ``python -m identify.output.as_json`` writes the schema anew.
"""
