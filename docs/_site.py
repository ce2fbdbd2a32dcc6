"""Pages of the site that come from the code, and what Sphinx lacks for the others.

Tables of outputs come from docstrings and from a press, the verification index from validation/.  A formula becomes
MathML, which browsers set without a script or a font from elsewhere.
"""

from __future__ import annotations

import dataclasses
import hashlib
import os
import re
from pathlib import Path
from typing import Any

from docutils import nodes
from docutils.utils.math import latex2mathml
from sphinx import addnodes
from sphinx.transforms import SphinxTransform
from sphinx.transforms.post_transforms import SphinxPostTransform

ROOT = Path(__file__).resolve().parent.parent
UNITS = {"_mm2": "mm²", "_Nmm": "N mm", "_mJ": "mJ", "_mm": "mm", "_deg": "degrees", "_N": "N", "_s": "s"}


def unit(key: str) -> str:
    """Return the unit that the name of a number ends in."""
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
    pages = {"outputs": outputs(), "commands": commands(), "studies": studies(), "verdict": verdict()}
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
