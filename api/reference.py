"""The scene reference, docs/reference.md, as it follows from the schema and the examples."""

import json
import pathlib
import re

EXAMPLES = pathlib.Path(__file__).parent / "examples"
PREFIX = "#/components/schemas/"
SHARED = 3  # members of the scene that use a type before it is told apart from them
EXAMPLE_MOST = 240  # characters
LONG = 120  # characters: the description of a string that is told once, in a section of its own
UNITS = {"degrees": r"\bin degrees\b|^Degrees\b", "pixels": r"^In pixels\b", "nm": r"^(In )?nm\b",
         "stops": r"^In stops\b", "rays a pixel": r"^Rays a pixel\b"}

INTRODUCTION = """\
# The scene, member by member

This page is made of the schema in [api/openapi.yaml](../api/openapi.yaml) by `./dev api`; editors read it as
[api/scene.schema.json](../api/scene.schema.json). A document has the members of [Scene](#scene), of which only
`objects` is required. Unknown members are errors. Angles are degrees, cones are half-angles, lengths have no unit,
the frame is right-handed with +Y up. [model.md](model.md) says what is computed from the values,
[requests.md](requests.md) shows requests, and the [gallery](gallery/README.md) whole scenes.
"""


def words(text):
    """A description in one cell of a table."""
    return " ".join((text or "").split()).replace("|", "\\|")


class Schemas:
    def __init__(self, schemas):
        self.all = schemas

    def name(self, schema):
        """Of a schema that is nothing but a reference to another; None: it is one itself."""
        parts = schema.get("allOf", [])
        inner = schema if "$ref" in schema else parts[0] if len(parts) == 1 and "$ref" in parts[0] else {}
        return inner["$ref"].removeprefix(PREFIX) if "$ref" in inner else None

    def has_section(self, name):
        schema = self.all[name]
        return "properties" in schema or any(
            "$ref" in part or "properties" in part
            for key in ("oneOf", "anyOf") for part in schema.get(key, [])) or len(schema.get("allOf", [])) > 1 or (
                name == "Output" or (schema.get("type") == "string" and "enum" not in schema and
                                     len(schema.get("description", "")) > LONG))

    def find(self, schema):
        """(the section that a schema leads to, or None; the schemas on the way, nearest first)"""
        way = [schema]
        while (name := self.name(schema)) is not None:
            if self.has_section(name):
                return name, way
            schema = self.all[name]
            way.append(schema)
        return None, way

    # ---- What a schema says, in words ----

    def type_of(self, schema):
        section, way = self.find(schema)
        if section:
            return f"[{section}](#{section.lower()})"
        last = way[-1]
        if "const" in last:
            return f"`{json.dumps(last['const'])}`"
        if "enum" in last:
            return " ".join(f"`{json.dumps(value)}`" for value in last["enum"])
        for key in ("oneOf", "anyOf"):
            if key in last:
                return " or ".join(dict.fromkeys(map(self.type_of, last[key])))
        if last.get("type") == "array":
            count = last.get("minItems", "") if last.get("minItems") == last.get("maxItems") else ""
            items = self.type_of(last.get("items", {}))
            plain = items in ("number", "integer", "string")
            return f"{count} {items}s".strip() if count and plain else f"array of {items}{'s' * plain}"
        if last.get("type") == "object":
            inner = last.get("additionalProperties")
            return f"object of {self.type_of(inner)} by name" if isinstance(inner, dict) else "object"
        return last.get("type", "any")

    def range_of(self, schema):
        section, way = self.find(schema)
        if section:
            return ""
        last = {key: value for part in reversed(way) for key, value in part.items()}
        found = [one_range(last)]
        for key in ("oneOf", "anyOf"):
            found += [self.range_of(part) for part in last.get(key, [])]
        if isinstance(last.get("items"), dict):
            found.append(self.range_of(last["items"]))
        contained = last.get("contains", {}).get("not", {}).get("const")
        found += [f"not all {contained}"] if contained is not None else []
        return "; ".join(dict.fromkeys(filter(None, found)))

    def first(self, schema, key):
        """What the nearest schema on the way says."""
        section, way = self.find(schema)
        if section:
            way = [*way, self.all[section]]
        return next((part[key] for part in way if key in part), None)

    def sections(self, schema):
        """The sections that a schema leads to, those in it last; each once."""
        found, waiting = [], [schema]
        while waiting:
            part = waiting.pop(0)
            if isinstance(part, list):
                waiting = part + waiting
            elif isinstance(part, dict):
                name = part.get("$ref", "").removeprefix(PREFIX)
                if name:
                    if name in found:
                        continue
                    found.append(name)
                    waiting.insert(0, self.all[name])
                else:
                    waiting = [value for key, value in part.items() if key != "discriminator"] + waiting
        return [name for name in found if self.has_section(name)]


def one_range(schema):
    if "not" in schema and schema["not"].get("const") is not None:
        return f"not {schema['not']['const']}"
    if "pattern" in schema:
        return "`" + schema["pattern"].replace("|", "\\|") + "`"
    low, high = schema.get("minimum"), schema.get("maximum")
    above, below = schema.get("exclusiveMinimum"), schema.get("exclusiveMaximum")
    if low is not None and high is not None:
        return f"{low} to {high}"
    parts = [f"above {above}"] if above is not None else []
    parts += [f"below {below}"] if below is not None else []
    parts += [f"{low} or more"] if low is not None else []
    parts += [f"up to {high}"] if high is not None else []
    fewest, most = schema.get("minItems"), schema.get("maxItems")
    if fewest != most:
        parts += [f"{fewest} to {most} entries"] if fewest and most else \
            [f"{fewest} or more entries"] if fewest else [f"up to {most} entries"]
    return ", ".join(parts)


# ---- Examples: what the scenes of api/examples have at a type's place ----

def fits(schemas, value, schema):
    """Whether a value looks like a schema's: enough to choose among alternatives."""
    if "$ref" in schema:
        return fits(schemas, value, schemas.all[schema["$ref"].removeprefix(PREFIX)])
    for key in ("oneOf", "anyOf"):
        if key in schema and not any(fits(schemas, value, part) for part in schema[key]):
            return False
    if not all(fits(schemas, value, part) for part in schema.get("allOf", [])):
        return False
    if ("const" in schema and value != schema["const"]) or ("enum" in schema and value not in schema["enum"]):
        return False
    types = {"object": dict, "array": list, "string": str, "boolean": bool, "null": type(None),
             "number": (int, float), "integer": int}
    kind = schema.get("type")
    if kind and (not isinstance(value, types[kind]) or (isinstance(value, bool) and kind != "boolean")):
        return False
    if isinstance(value, list):
        return (schema.get("minItems", 0) <= len(value) <= schema.get("maxItems", len(value)) and
                all(fits(schemas, item, schema.get("items", {})) for item in value[:8]))
    if isinstance(value, dict) and "properties" in schema:
        known = schema["properties"]
        return set(schema.get("required", [])) <= set(value) and (
            schema.get("additionalProperties") is not False or set(value) <= set(known)) and all(
                fits(schemas, value[key], known[key]) for key in value if key in known)
    return True


def collect(schemas, value, schema, found):
    """found[name]: what stands at that type's places."""
    if "$ref" in schema:
        name = schema["$ref"].removeprefix(PREFIX)
        found.setdefault(name, []).append(value)
        collect(schemas, value, schemas.all[name], found)
        return
    for key in ("oneOf", "anyOf", "allOf"):
        for part in schema.get(key, []):
            if fits(schemas, value, part):
                collect(schemas, value, part, found)
    if isinstance(value, dict):
        more = schema.get("additionalProperties")
        for key, inner in value.items():
            part = schema.get("properties", {}).get(key, more if isinstance(more, dict) else None)
            if isinstance(part, dict):
                collect(schemas, inner, part, found)
    elif isinstance(value, list) and isinstance(schema.get("items"), dict):
        for inner in value:
            collect(schemas, inner, schema["items"], found)


def examples(schemas):
    found = {}
    for name, schema in schemas.all.items():
        for value in schema.get("examples", []):
            collect(schemas, value, {"$ref": PREFIX + name}, found)
    for path in sorted(EXAMPLES.glob("*.json")):
        collect(schemas, json.loads(path.read_text(encoding="utf-8")), {"$ref": PREFIX + "Scene"}, found)
    return found


def best(values):
    """The fullest one that is short."""
    texts = {json.dumps(value, ensure_ascii=False) for value in values}
    short = [text for text in texts if len(text) <= EXAMPLE_MOST]
    return max(short, key=lambda text: (text.count('": '), -len(text), text), default=None)


def sample(schemas, schema):
    """The least that a schema takes, its defaults where there are some."""
    section, way = schemas.find(schema)
    last = {key: value for part in reversed(way) for key, value in part.items()}
    if section:
        last = {**schemas.all[section], **last}
    if "default" in last or "const" in last:
        return last.get("default", last.get("const"))
    for key in ("oneOf", "anyOf", "enum"):
        if key in last:
            return last[key][0] if key == "enum" else sample(schemas, last[key][0])
    if "properties" in last:
        members = {name: sample(schemas, part) for name, part in last["properties"].items()
                   if name in last.get("required", []) or schemas.first(part, "default") is not None}
        return members
    if last["type"] == "array":
        return [sample(schemas, last["items"]) for _ in range(last.get("minItems", 1))]
    if last["type"] == "string":
        return "sha256-" + "0" * 64 if last.get("pattern", "").startswith("^sha256") else "name"
    return last.get("minimum", 1) or 1


# ---- The page ----

def unit_of(text):
    return next((unit for unit, pattern in UNITS.items() if re.search(pattern, text)), "")


def takes_nothing(schemas, name):
    """Whether a document that says nothing of a type means the first of its kinds, with all defaults."""
    schema = schemas.all[name]
    parts = [part for key in ("oneOf", "anyOf", "allOf") for part in schema.get(key, [])]
    if parts and "$ref" in parts[0]:
        return takes_nothing(schemas, parts[0]["$ref"].removeprefix(PREFIX))
    return "properties" in schema and not schema.get("required")


def row(schemas, member, schema, required):
    meaning = words(schemas.first(schema, "description"))
    section = schemas.find(schema)[0]
    if section and "description" not in schema:
        meaning = words(next((part["description"] for part in schemas.find(schema)[1] if "description" in part), ""))
    default = schemas.first(schema, "default")
    told = re.search(r"Default:\s*(.*?)\.?$", meaning)
    shown = "**required**" if required else f"`{json.dumps(default)}`" if default is not None else \
        "see right" if told or meaning.startswith(("Absent:", "Default")) else \
        "its defaults" if section and takes_nothing(schemas, section) else "none"
    limits = ", ".join(filter(None, [schemas.range_of(schema), unit_of(meaning)]))
    return f"| `{member}` | {schemas.type_of(schema)} | {limits} | {shown} | {meaning} |"


def exclusions(schema):
    return [f"`{member}` excludes {' and '.join(f'`{other}`' for other, part in rule['properties'].items() if part is False)}."
            for member, rule in schema.get("dependentSchemas", {}).items()
            if any(part is False for part in rule.get("properties", {}).values())]


def alternative(schemas, part):
    limits = schemas.range_of(part)
    members = ", ".join(f"`{member}`" for member in part.get("properties", {}))
    return f"- {schemas.type_of(part)}" + (f", {limits}" if limits else "") + (f" with {members}" if members else "")


def section(schemas, name, found):
    schema = schemas.all[name]
    lines = [f"### {name}", ""]
    if schema.get("description"):
        lines += [" ".join(schema["description"].split()), ""]
    bases = [part for part in schema.get("allOf", []) if "$ref" in part]
    own = {**schema.get("properties", {})}
    required = set(schema.get("required", []))
    for part in schema.get("allOf", []):
        own.update(part.get("properties", {}))
        required |= set(part.get("required", []))
    if bases:
        lines += ["It has the members of " + ", ".join(map(schemas.type_of, bases)) + (", and these:" if own else "."), ""]
    for key in ("oneOf", "anyOf"):
        if key in schema and not own:
            lines += ["One of:", "", *dict.fromkeys(alternative(schemas, part) for part in schema[key]), ""]
            for part in schema[key]:
                own.update(part.get("properties", {}))
                required |= set(part.get("required", []))
    if own:
        lines += ["| member | type | range, unit | default | meaning |", "| --- | --- | --- | --- | --- |"]
        lines += [row(schemas, member, part, member in required) for member, part in own.items()]
        lines.append("")
    lines += exclusions(schema) and [" ".join(exclusions(schema)), ""]
    shown = [json.dumps(value, ensure_ascii=False) for value in schema.get("examples", [])] or \
        [best(found.get(name, [])) or json.dumps(sample(schemas, {"$ref": PREFIX + name}))]
    lines += ["```json", *shown, "```", ""]
    return lines


def page(document):
    schemas = Schemas(document["components"]["schemas"])
    scene = schemas.all["Scene"]
    leads = {member: schemas.sections(part) for member, part in scene["properties"].items()}
    uses = {}
    for member, names in leads.items():
        for name in names:
            uses.setdefault(name, []).append(member)
    found = examples(schemas)
    lines = [INTRODUCTION, "## The document", "", *section(schemas, "Scene", found)]
    for member, names in leads.items():
        names = [name for name in names if uses[name][0] == member and len(uses[name]) < SHARED]
        if names:
            lines += [f"## {member}", ""]
            for name in names:
                lines += section(schemas, name, found)
    lines += ["## Values that several members take", ""]
    for name in sorted(name for name, members in uses.items() if len(members) >= SHARED):
        lines += section(schemas, name, found)
    return "\n".join(lines).rstrip() + "\n"
