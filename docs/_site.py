"""Pages of the site that come from the code, and what Sphinx lacks for the others.

Key tables come from the JSON schema of a scene, tables of outputs from docstrings and from a press, the verification
index from validation/.  A formula becomes MathML, which browsers set without a script or a font from elsewhere.
"""

from __future__ import annotations

import dataclasses
import hashlib
import os
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from docutils import nodes
from docutils.utils.math import latex2mathml
from sphinx import addnodes
from sphinx.transforms import SphinxTransform
from sphinx.transforms.post_transforms import SphinxPostTransform

ROOT = Path(__file__).resolve().parent.parent
UNITS = {
    "_mm2": "mm²", "_mm3": "mm³", "_Nmm": "N mm", "_mJ": "mJ", "_MPa": "MPa", "_mm": "mm", "_deg": "degrees", "_N": "N",
    "_seconds": "s", "_s": "s", "_MB": "MB", "_kg_m3": "kg/m³", "_g": "g",
}  # fmt: skip


def unit(key: str) -> str:
    """Return the unit that the name of a key ends in."""
    return next((text for suffix, text in UNITS.items() if key.endswith(suffix)), "")


def digest() -> str:
    """Return 16 digits that change with any source of the package or the designs."""
    found = hashlib.sha256()
    for path in sorted(path for folder in ("finger3d", "geometries") for path in (ROOT / folder).rglob("*.py")):
        found.update(path.read_bytes())
    return found.hexdigest()[:16]


def write_generated(docs: Path) -> None:
    """Write the generated parts of pages into docs/_generated; files that stay the same are left alone."""
    folder = docs / "_generated"
    folder.mkdir(exist_ok=True)
    pages = {"keys": keys(), "outputs": outputs(), "commands": commands(), "studies": studies(), "verdict": verdict()}
    for name, text in pages.items():
        _write(folder / f"{name}.md", text)


def write_notebooks(folder: Path) -> None:
    """Write every tutorial, a script in the percent format, as a notebook beside it, which is executed and shown."""
    import jupytext

    for script in sorted(folder.glob("*.py")):
        notebook = jupytext.read(script, fmt="py:percent")
        notebook.metadata["language_info"] = {"name": "python", "pygments_lexer": "ipython3"}
        for number, cell in enumerate(notebook.cells):
            cell["id"] = f"cell-{number}"  # not random, so that a script that did not change gives the same notebook
        _write(script.with_suffix(".ipynb"), jupytext.writes(notebook, fmt="ipynb"))


def _write(path: Path, text: str) -> None:
    if not path.exists() or path.read_text(encoding="utf-8") != text:
        path.write_text(text, encoding="utf-8")


def keys() -> str:
    """Return a section for every table of a scene, from the JSON schema."""
    from finger3d.scene.schema import schema

    lines = []
    for title, table in _scene_tables(schema()):
        lines += [f"## `{title}`", "", "| key | allowed | unit | default | meaning |", "|---|---|---|---|---|"]
        required = table.get("required", ())
        for key, node in table["properties"].items():
            default = "required" if key in required else f"`{_toml(node['default'])}`" if "default" in node else ""
            cells = (f"`{key}`", _allowed(node), unit(key), default, node.get("description", ""))
            lines.append("| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |")
        if not table["properties"]:
            lines.append("| | | | | no keys |")
        lines.append("")
    return "\n".join(lines)


def _scene_tables(schema: dict[str, Any]) -> Iterator[tuple[str, dict[str, Any]]]:
    top = schema["properties"]
    yield "title", {"properties": {"title": top["title"]}}
    for name, node in top.items():
        if name == "title":
            continue
        if name == "press":
            legs = node["oneOf"][1]["properties"]["leg"]["items"]
            yield "[press] or [[press.leg]]", legs
        elif "oneOf" in node and "properties" not in node:
            for choice in node["oneOf"]:
                kind = next(iter(choice["properties"]))
                told = choice["properties"][kind].get("const", choice.get("title"))
                yield f'[{name}] {kind} = "{told}"', choice
        elif name == "effects":
            # true and false stand for a table, too
            tables = {key: table["oneOf"][1] for key, table in node["properties"].items() if "oneOf" in table}
            own = {key: value for key, value in node["properties"].items() if key not in tables}
            yield "[effects]", {"properties": own}
            yield from ((f"[effects.{effect}]", table) for effect, table in tables.items())
        elif node["type"] == "array":
            yield f"[[{name}]]", node["items"]
        elif isinstance(node.get("additionalProperties"), dict):
            yield f"[{name}.LABEL]", node["additionalProperties"]
        else:
            yield f"[{name}]", node


def _allowed(node: dict[str, Any]) -> str:
    from finger3d._ranges import number

    if "const" in node:
        return f"`{_toml(node['const'])}`"
    if "enum" in node:
        return ", ".join(f"`{_toml(value)}`" for value in node["enum"])
    if "anyOf" in node:
        return " or ".join(_allowed(choice) for choice in node["anyOf"])
    if node["type"] == "array":
        if "prefixItems" in node:
            low, *others = (_allowed(choice) for choice in node["prefixItems"])
            assert {*others} == {low}
            return f"list of {len(others) + 1}, each a {low}"
        inner = node["items"]
        return f"list of {_allowed(inner)}" if "prefixItems" not in inner else "list of pairs"
    low, high = node.get("minimum", node.get("exclusiveMinimum")), node.get("maximum", node.get("exclusiveMaximum"))
    if low is not None and low == high:
        return number(low)
    names = {"number": "number", "integer": "whole number", "string": "text", "boolean": "true or false"}
    bounds = "" if low is None or high is None else f", {number(low)} to {number(high)}"
    ends = " (ends excluded)" if "exclusiveMinimum" in node or "exclusiveMaximum" in node else ""
    return names[node["type"]] + bounds + ends


def _toml(value: object) -> str:
    from finger3d.scene.messages import shown

    return shown(value)


def outputs() -> str:
    """Return the tables of the numbers of a press, from the docstring of `PressStep` and the columns of contact.csv."""
    from finger3d.results.summary import PressStep
    from finger3d.scene.schema import descriptions

    said = {name: text.replace("|", r"\|") for name, text in descriptions(PressStep).items()}
    lines = ["| key | unit | meaning |", "|---|---|---|"]
    lines += [f"| `{f.name}` | {unit(f.name) or '–'} | {said[f.name]} |" for f in dataclasses.fields(PressStep)]
    return "\n".join(lines) + "\n"


def commands() -> str:
    """Return the help of every command."""
    import io

    from rich.console import Console

    import finger3d.cli  # noqa: F401  (registers the commands)
    from finger3d.cli.common import app

    lines = []
    for name in sorted(n for n in app if not n.startswith("-")):
        page = Console(file=io.StringIO(), width=100, force_terminal=False, color_system=None)
        app.help_print([name], console=page)
        lines += [f"## {name}", "", "```text", page.file.getvalue().strip(), "```", ""]
    return "\n".join(lines)


def studies() -> str:
    """Return the index of validation/, its links relative to docs/."""
    text = (ROOT / "validation" / "README.md").read_text(encoding="utf-8")
    return _linked_from_docs(text[text.index("\n- *Verification*") :])


def verdict() -> str:
    """Return the table of the paper's claims from the index of validation/, its links relative to docs/."""
    text = (ROOT / "validation" / "README.md").read_text(encoding="utf-8")
    return _linked_from_docs(text[text.index("\nEvery cell") : text.index("\n## Studies")])


def _linked_from_docs(part: str) -> str:
    return re.sub(r"\]\((?!https?:|#)", "](../validation/", part) + "\n"


_SHORT = re.compile(r"^(\w+(?:, \w+)*) : (.+)$")


def descriptions_below(lines: list[str]) -> list[str]:
    """Return a docstring whose short form, ``name : description``, has the description in a line of its own.

    Napoleon takes what follows the colon for a type. It is one where the next line is indented and starts a sentence.
    """
    out: list[str] = []
    section = ""
    for line, following in zip(lines, [*lines[1:], ""], strict=True):
        if set(following.strip()) == {"-"}:
            section = line.strip()
        found = _SHORT.match(line) if section in ("Parameters", "Attributes") else None
        if found and not re.match(r" +[A-Z(`]", following):
            out += [found[1], f"    {found[2]}"]
        else:
            out.append(line)
    return out


class MathML:
    """Renderers of formulas as MathML."""

    @staticmethod
    def inline(writer: Any, node: nodes.math) -> None:
        """Write an inline formula."""
        writer.body.append(latex2mathml.tex2mathml(node.astext()))
        raise nodes.SkipNode

    @staticmethod
    def block(writer: Any, node: nodes.math_block) -> None:
        """Write a displayed formula."""
        writer.body.append(f'<div class="math">{latex2mathml.tex2mathml(node.astext(), as_block=True)}</div>')
        raise nodes.SkipNode


class FullSizeFigures(SphinxTransform):
    """Figures of validation/ are wider than a page: Sphinx links an image that is scaled to its full size."""

    default_priority = 800  # after parsing

    def apply(self, **kwargs: Any) -> None:
        """Scale the figures to the width of the page."""
        for image in self.document.findall(nodes.image):
            if "validation/figures/" in image["uri"]:
                image["width"] = "100%"


class ProjectLinks(SphinxPostTransform):
    """Links to files outside docs/: pages of the site where they are included, downloads otherwise."""

    default_priority = 5  # before MyST looks for the targets
    pages = {
        "validation/README.md": "verification",
        "validation/REFERENCES.md": "theory/solutions",
        "CONTRIBUTING.md": "contributing",
        "README.md": "index",
    }

    def run(self, **kwargs: Any) -> None:
        """Replace references to files that MyST takes for unknown pages."""
        for node in list(self.document.findall(addnodes.pending_xref)):
            target = node.get("reftarget", "")
            if node.get("reftype") != "myst" and node.get("refdomain") != "doc":
                continue
            folder = Path(self.env.doc2path(self.env.docname)).parent
            path = Path(os.path.normpath(folder / f"{target}"))
            for candidate in (path, path.with_suffix(".md"), ROOT / target):
                name = candidate.relative_to(ROOT).as_posix() if candidate.is_relative_to(ROOT) else ""
                if name in self.pages:
                    uri = self.app.builder.get_relative_uri(self.env.docname, self.pages[name])
                    node.replace_self(nodes.reference("", "", *node.children, internal=True, refuri=uri))
                    break
