"""The JSON schemas of the TOML files that a user writes, for editors to complete and check them.

An editor with TOML support takes a schema from a first line such as

    #:schema .venv/lib/python3/site-packages/twin/schemas/model.schema.json

`python -m twin.schemas` writes them anew, after a change of an effect or of an entry. Beside them
lies the schema of what commands print (`identify.output.as_json`).
"""

from __future__ import annotations

import json
from pathlib import Path

FOLDER = Path(__file__).parent


def written() -> dict[Path, str]:
    """Each schema file and its text."""
    from twin.effects import load_catalogue
    from twin.importers import mapping
    from twin.model import schema

    documents = {
        "model.schema.json": schema.json_schema(load_catalogue()),
        "map.schema.json": mapping.json_schema(),
    }
    return {
        FOLDER / name: json.dumps(document, indent=1, ensure_ascii=False) + "\n"
        for name, document in documents.items()
    }
