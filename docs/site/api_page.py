"""The page of the API: api/openapi.json as HTML, without a script."""

import html
import json
import re
import subprocess

CUT = "<!-- cut -->"
METHODS = ["get", "post", "put", "delete", "head", "options"]
QUIET = ["head", "options"]  # told in a line with the others of their path
PREFIX = "#/components/"


class Words:
    """Descriptions are Markdown. One run of cmark-gfm reads them all."""

    def __init__(self):
        self.texts = []

    def add(self, text, inline=False):
        if not (text or "").strip():
            return ""
        self.texts.append(text.strip())
        return f"\0{'i' if inline else 'b'}{len(self.texts) - 1}\0"

    def fill(self, page):
        made = subprocess.run(["cmark-gfm", "--unsafe", "-e", "table", "--to", "html"], check=True,
                              input=f"\n\n{CUT}\n\n".join(self.texts), capture_output=True, text=True,
                              encoding="utf-8").stdout.split(CUT)

        def one(match):
            text = made[int(match[2])].strip()
            return re.sub(r"^<p>(.*)</p>$", r"\1", text, flags=re.S).replace("</p>\n<p>", "<br>") \
                if match[1] == "i" else text

        return re.sub("\0([ib])([0-9]+)\0", one, page)


class Api:
    def __init__(self, document):
        self.document, self.words = document, Words()
        self.headings, self.parts = [], []
        self.of_scene = self.reached("Scene")

    def resolve(self, part):
        while "$ref" in part:
            *way, name = part["$ref"].removeprefix(PREFIX).split("/")
            part = self.document["components"][way[0]][name]
        return part

    def reached(self, name, found=None):
        found = set() if found is None else found
        if name in found:
            return found
        found.add(name)
        text = json.dumps(self.document["components"]["schemas"][name])
        for inner in re.findall(r'"#/components/schemas/(\w+)"', text):
            self.reached(inner, found)
        return found

    # ---- Schemas in words ----

    def link(self, name):
        schema = self.document["components"]["schemas"][name]
        if name not in self.of_scene:
            return f'<a href="#schema-{name.lower()}">{name}</a>'
        if self.is_told(schema):
            return f'<a href="reference#{name.lower()}">{name}</a>'
        return self.type_of(schema)

    def is_told(self, schema):
        """Whether the reference of the scene has a section for it (api/reference.py)."""
        return "properties" in schema or len(schema.get("allOf", [])) > 1 or any(
            "$ref" in part or "properties" in part
            for key in ("oneOf", "anyOf") for part in schema.get(key, []))

    def type_of(self, schema):
        if "$ref" in schema:
            return self.link(schema["$ref"].rsplit("/", 1)[1])
        if "const" in schema:
            return f"<code>{html.escape(json.dumps(schema['const']))}</code>"
        if "enum" in schema:
            return " ".join(f"<code>{html.escape(json.dumps(value))}</code>" for value in schema["enum"])
        for key in ("oneOf", "anyOf", "allOf"):
            if key in schema:
                glue = " and " if key == "allOf" else " or "
                return glue.join(dict.fromkeys(map(self.type_of, schema[key])))
        kind = schema.get("type", "any")
        if isinstance(kind, list):
            kind = " or ".join(kind)
        if kind == "array":
            return f"array of {self.type_of(schema.get('items', {}))}"
        if kind == "object" and isinstance(schema.get("additionalProperties"), dict):
            return f"object of {self.type_of(schema['additionalProperties'])} by name"
        limits = [f"{words} {schema[key]}" for key, words in (
            ("minimum", "from"), ("exclusiveMinimum", "above"), ("maximum", "to"), ("exclusiveMaximum", "below"))
            if key in schema]
        limits += [f"<code>{html.escape(schema['pattern'])}</code>"] if "pattern" in schema else []
        limits += [f"default <code>{html.escape(json.dumps(schema['default']))}</code>"] if "default" in schema else []
        return " ".join([kind, *limits])

    def example_of(self, holder):
        values = [example["value"] for example in map(self.resolve, holder.get("examples", {}).values())] \
            if isinstance(holder.get("examples"), dict) else []
        return values + ([holder["example"]] if "example" in holder else [])

    # ---- Pieces of the page ----

    def heading(self, level, anchor, text):
        self.headings.append((level, anchor, text))
        self.parts.append(f'<h{level} id="{anchor}">{text}<a class="anchor" href="#{anchor}" '
                          f'aria-label="Link to this section"></a></h{level}>')

    def table(self, columns, rows):
        head = "".join(f"<th>{column}</th>" for column in columns)
        body = "".join("<tr>" + "".join(f"<td>{cell}</td>" for cell in row) + "</tr>" for row in rows)
        self.parts.append('<div class="scroll" tabindex="0"><table><thead><tr>'
                          f"{head}</tr></thead><tbody>{body}</tbody></table></div>")

    def code(self, value):
        text = value if isinstance(value, str) else json.dumps(value, indent=2, ensure_ascii=False)
        text = re.sub(r"\[\s+([-\d.,\s]+?)\s+\]", lambda match: f"[{' '.join(match[1].split())}]", text)
        self.parts.append(f'<pre><code class="language-json">{html.escape(text, quote=False)}</code></pre>')

    def fold(self, words, make, is_open=False):
        self.parts.append(f"<details{' open' if is_open else ''}><summary>{words}</summary>")
        make()
        self.parts.append("</details>")

    # ---- Operations ----

    def parameters(self, operation):
        rows = []
        for parameter in map(self.resolve, operation.get("parameters", [])):
            told = self.words.add(parameter.get("description"), inline=True)
            examples = "".join(f"<br>Such as <code>{html.escape(str(value))}</code>"
                               for value in self.example_of(parameter)[:1])
            rows.append((f"<code>{html.escape(parameter['name'])}</code>"
                         + ("<br><b>required</b>" if parameter.get("required") else ""),
                         parameter["in"], self.type_of(parameter["schema"]), told + examples))
        if rows:
            self.parts.append("<h4>Parameters</h4>")
            self.table(["name", "in", "type", "meaning"], rows)

    def body(self, operation):
        if "requestBody" not in operation:
            return
        body = self.resolve(operation["requestBody"])
        self.parts.append(f"<h4>Body</h4>{self.words.add(body.get('description'))}")
        for media_type, content in body["content"].items():
            kind = self.type_of(content["schema"]) if "schema" in content else "bytes"
            self.parts.append(f"<p><code>{media_type}</code>: {kind}</p>")
            for value in self.example_of(content):
                self.code(value)

    def response(self, status, response):
        name = response.get("$ref", "").rsplit("/", 1)[-1]
        response = self.resolve(response)
        if name:
            return (f"<b>{status}</b>", f'<a href="#response-{name.lower()}">{name}</a>: '
                    + self.words.add(response["description"], inline=True))
        return (f"<b>{status}</b>", self.words.add(response["description"], inline=True)
                + self.content(response) + self.fields(response))

    def content(self, response):
        kinds = [f"<code>{media_type}</code>"
                 + (f" {self.type_of(content['schema'])}" if "schema" in content else "")
                 for media_type, content in response.get("content", {}).items()]
        return f"<br>{', '.join(kinds)}" if kinds else ""

    def fields(self, response):
        links = []
        for field, header in response.get("headers", {}).items():
            name = header.get("$ref", "").rsplit("/", 1)[-1]
            links.append(f'<a href="#header-{name.lower()}"><code>{field}</code></a>' if name else
                         f"<code>{field}</code>")
        return f"<br>Fields: {', '.join(links)}" if links else ""

    def operation(self, path, method, operation, others):
        self.heading(3, operation["operationId"].lower(),
                     f'<span class="method {method}">{method.upper()}</span> <code>{html.escape(path)}</code>')
        self.parts.append(f"<p class=\"summary\">{self.words.add(operation['summary'], inline=True)}"
                          + (f" <small>Also {', '.join(others)}</small>" if others else "") + "</p>")
        self.parts.append(self.words.add(operation.get("description")))
        self.parameters(operation)
        self.body(operation)
        answers = list(operation["responses"].items())
        self.parts.append("<h4>Answers</h4>")
        self.table(["status", "meaning"], [self.response(*answer) for answer in answers if answer[0] < "400"])
        self.fold("What else may be answered", lambda: self.table(
            ["status", "meaning"], [self.response(*answer) for answer in answers if answer[0] >= "400"]))

    def operations(self, tag):
        for path, item in self.document["paths"].items():
            loud = [method for method in METHODS if method in item and method not in QUIET]
            quiet = [method.upper() for method in QUIET if method in item]
            for method in loud:
                if tag in item[method]["tags"]:
                    self.operation(path, method, item[method], quiet)

    # ---- What operations share ----

    def responses(self):
        self.heading(2, "answers", "Answers that several share")
        for name, response in self.document["components"]["responses"].items():
            self.heading(3, f"response-{name.lower()}", name)
            self.parts.append(f"<p>{self.words.add(response['description'], inline=True)}"
                              f"{self.content(response)}{self.fields(response)}</p>")
            for content in response.get("content", {}).values():
                for value in self.example_of(content)[:1]:
                    self.code(value)

    def headers(self):
        self.heading(2, "fields", "Fields of answers")
        rows = []
        for name, header in self.document["components"]["headers"].items():
            example = "".join(f"<br>Such as <code>{html.escape(str(value))}</code>" for value in self.example_of(header))
            rows.append((f'<span id="header-{name.lower()}">{name}</span>', self.type_of(header["schema"]),
                         self.words.add(header.get("description"), inline=True) + example))
        self.table(["name", "type", "meaning"], rows)

    def schema(self, name, schema):
        self.heading(3, f"schema-{name.lower()}", name)
        self.parts.append(self.words.add(schema.get("description")))
        members = dict(schema.get("properties", {}))
        required = set(schema.get("required", []))
        for part in schema.get("allOf", []):
            members.update(part.get("properties", {}))
            required |= set(part.get("required", []))
        if members:
            self.table(["member", "type", "meaning"], [
                (f"<code>{html.escape(member)}</code>" + ("<br><b>required</b>" if member in required else ""),
                 self.type_of(part), self.words.add(self.told(part), inline=True))
                for member, part in members.items()])
            if any("$ref" in part for part in schema.get("allOf", [])):
                self.parts.append(f"<p>Also: {self.type_of({'allOf': [p for p in schema['allOf'] if '$ref' in p]})}</p>")
        else:
            self.parts.append(f"<p>{self.type_of(schema)}</p>")
        for value in schema.get("examples", [])[:2]:
            self.code(value)

    def told(self, part):
        return part.get("description") or (self.resolve(part).get("description", "") if "$ref" in part and
                                           part["$ref"].rsplit("/", 1)[1] in self.of_scene else "")

    def schemas(self):
        self.heading(2, "schemas", "Documents of requests and answers")
        self.parts.append('<p>The scene document has <a href="reference">a page of its own</a>.</p>')
        for name, schema in self.document["components"]["schemas"].items():
            if name not in self.of_scene:
                self.schema(name, schema)

    def overview(self):
        for tag in self.document["tags"]:
            rows = []
            for path, item in self.document["paths"].items():
                for method in METHODS:
                    if method in item and method not in QUIET and tag["name"] in item[method]["tags"]:
                        rows.append((f'<a href="#{item[method]["operationId"].lower()}">'
                                     f'<span class="method {method}">{method.upper()}</span> '
                                     f"<code>{html.escape(path)}</code></a>",
                                     self.words.add(item[method]["summary"], inline=True)))
            self.table([tag["name"], html.escape(tag["description"])], rows)


def make(document):
    """(title, [(level, anchor, words)], body)"""
    api = Api(document)
    info = document["info"]
    api.parts.append(f"<h1>The API</h1><p>{html.escape(info['summary'])}. This is version {info['version']}, "
                     'as <a href="../openapi.yaml">openapi.yaml</a>, <a href="../openapi.json">openapi.json</a> and, '
                     'of scenes alone, <a href="../scene.schema.json">scene.schema.json</a> have it. '
                     '<a href="requests">Requests</a> has examples in prose.</p>')
    api.overview()
    api.heading(2, "always", "What holds everywhere")
    api.parts.append(api.words.add(info["description"]))
    for tag in document["tags"]:
        api.heading(2, f"tag-{tag['name']}", tag["name"].capitalize())
        api.parts.append(f"<p>{html.escape(tag['description'])}.</p>")
        api.operations(tag["name"])
    api.responses()
    api.headers()
    api.schemas()
    return "The API", api.headings, api.words.fill("\n".join(api.parts))
