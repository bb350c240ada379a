#!/usr/bin/env python3
"""Makes scene.schema.json, openapi.json and docs/reference.md of openapi.yaml: `./dev api`."""

import json
import pathlib
import sys

import yaml

HERE = pathlib.Path(__file__).parent
sys.path.insert(0, str(HERE))

import reference  # noqa: E402: it lies beside this file, from wherever that is run
PREFIX = "#/components/schemas/"


def references(part):
    """The names of the schemas that a part refers to."""
    if isinstance(part, dict):
        if "$ref" in part:
            yield part["$ref"].removeprefix(PREFIX)
        for key, value in part.items():
            if key != "discriminator":
                yield from references(value)
    elif isinstance(part, list):
        for value in part:
            yield from references(value)


def moved(part):
    """The same for a schema that stands alone: JSON Schema knows no discriminators."""
    if isinstance(part, dict):
        return {key: moved(value) for key, value in part.items() if key != "discriminator"}
    if isinstance(part, list):
        return [moved(value) for value in part]
    return part.replace(PREFIX, "#/$defs/") if isinstance(part, str) else part


def scene_schema(document):
    schemas = document["components"]["schemas"]
    used, waiting = [], ["Scene"]
    while waiting:
        name = waiting.pop()
        if name not in used:
            used.append(name)
            waiting += references(schemas[name])
    defs = {name: moved(schemas[name]) for name in schemas if name in used and name != "Scene"}
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", "$id": "scene.schema.json",
            "title": "Scene", **moved(schemas["Scene"]), "$defs": defs}


def texts():
    """What the derived files hold, by their names."""
    document = yaml.safe_load((HERE / "openapi.yaml").read_text(encoding="utf-8"))
    return {"openapi.json": json.dumps(document, indent=1, ensure_ascii=False) + "\n",
            "scene.schema.json": json.dumps(scene_schema(document), indent=2,
                                            ensure_ascii=False) + "\n",
            "../docs/reference.md": reference.page(document)}


if __name__ == "__main__":
    for name, text in texts().items():
        (HERE / name).write_text(text, encoding="utf-8")
