"""Write the schema files."""

from twin.schemas import written

for path, text in written().items():
    path.write_text(text, encoding="utf-8")
