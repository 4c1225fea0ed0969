"""Links to files and folders of the repository outside ``docs`` lead to pages of the site that show them.

In the repository the same links lead to the files themselves.
"""

from collections.abc import Iterator
from html import escape
from pathlib import Path

from docutils import nodes
from pygments.lexers import get_lexer_for_filename
from pygments.util import ClassNotFound
from sphinx import addnodes
from sphinx.application import Sphinx
from sphinx.transforms import SphinxTransform

ROOT = Path(__file__).parents[2]
# Pages that include a document outside `docs`. Their links are relative to that document.
INCLUDED = {"changelog": "CHANGELOG.md", "configuration": "config/README.md", "contributing": "CONTRIBUTING.md"}
PAGES = {file: page for page, file in INCLUDED.items()} | {"README.md": "index"}
LINKS = (addnodes.download_reference, addnodes.pending_xref)


class RepositoryLinks(SphinxTransform):
    """Replace links that lead out of ``docs``, and those of documents that are included from outside."""

    default_priority = 500

    def apply(self) -> None:
        """Point each such link to the page that shows its file."""
        for link in list(self.document.findall(lambda node: isinstance(node, LINKS))):
            name, _, anchor = link["reftarget"].partition("#")
            if link.get("reftype") == "myst" and name and (path := self._path(link, name)):
                link.replace_self(self._reference(link, path, link.get("reftargetid") or anchor))

    def _path(self, link: nodes.Element, name: str) -> Path | None:
        """The link's target below the repository's root, if it is outside ``docs`` or the link itself is."""
        page = self.env.docname
        file = ROOT / INCLUDED[page] if page in INCLUDED else Path(self.env.doc2path(page))
        target = (file.parent / name).resolve()
        # MyST takes every Markdown file that exists for a page of the site and removes its ending.
        if link.get("refdomain") == "doc":
            target = target.with_name(f"{target.name}.md")
        is_here = target.is_relative_to(self.env.srcdir) and page not in INCLUDED
        return target.relative_to(ROOT) if target.is_relative_to(ROOT) and target.exists() and not is_here else None

    def _reference(self, link: nodes.Element, path: Path, anchor: str) -> nodes.Element:
        page = PAGES.get(str(path)) or self.env.path2doc(ROOT / path)
        if page in self.env.found_docs:
            anchor = anchor if page != "index" else ""
            target = {"refdomain": "doc", "reftarget": page, "reftargetid": anchor or None, "reftype": "myst"}
            return addnodes.pending_xref("", *link.children, refdoc=self.env.docname, refexplicit=True, **target)
        uri = f"{'../' * self.env.docname.count('/')}repository/{path}.html"
        return nodes.reference("", "", *link.children, internal=True, refuri=uri, repository_path=str(path))


def pages(app: Sphinx) -> Iterator[tuple[str, dict, str]]:
    """Make a page for each file and folder that some document links to."""
    paths = {
        link["repository_path"]
        for name in app.env.found_docs
        for link in app.env.get_doctree(name).findall(nodes.reference)
        if "repository_path" in link
    }
    for path in sorted(paths):
        show = _folder if (ROOT / path).is_dir() else _file
        title = f"<h1><code>{escape(path)}</code></h1>"
        yield f"repository/{path}", {"title": path, "body": title + show(app, ROOT / path)}, "page.html"


def _file(app: Sphinx, file: Path) -> str:
    text = file.read_text(encoding="utf-8")
    try:
        language = get_lexer_for_filename(file.name).aliases[0]
    except ClassNotFound:
        language = "text"
    return app.builder.highlighter.highlight_block(text, language)


def _folder(app: Sphinx, folder: Path) -> str:
    names = sorted(entry.name for entry in folder.iterdir() if not entry.name.startswith(("_", ".")))
    return "<ul>" + "".join(f"<li><code>{escape(name)}</code></li>" for name in names) + "</ul>"


def setup(app: Sphinx) -> dict[str, bool]:
    """Register the transform and the pages."""
    app.add_transform(RepositoryLinks)
    app.connect("html-collect-pages", pages)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
