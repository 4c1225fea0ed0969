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
# Documents outside `docs`, each included by a page of the site.
PAGES = {
    "CHANGELOG.md": "changelog",
    "CONTRIBUTING.md": "contributing",
    "README.md": "index",
    "config/README.md": "configuration",
}


class RepositoryLinks(SphinxTransform):
    """Replace links that lead out of ``docs``."""

    default_priority = 500

    def apply(self) -> None:
        """Point each such link to the page that shows its file."""
        for link in list(self.document.findall(lambda node: isinstance(node, LINKS))):
            path = self._path(link)
            if path in PAGES and PAGES[path] in self.env.found_docs:
                self._lead_to(link, PAGES[path])
            elif path:
                self._lead_to(link, f"repository/{path}")["repository_path"] = path

    def _path(self, link: nodes.Element) -> str | None:
        """Path of the link's target below the repository's root, if it is a file or folder outside ``docs``."""
        if link.get("reftype") != "myst":
            return None
        name = link["reftarget"].partition("#")[0]
        # MyST takes every Markdown file for a page of the site and removes its ending.
        target = (Path(self.env.doc2path(self.env.docname)).parent / name).resolve()
        if link.get("refdomain") == "doc":
            target = target.with_name(f"{target.name}.md")
        outside = target.is_relative_to(ROOT) and not target.is_relative_to(self.env.srcdir)
        return str(target.relative_to(ROOT)) if outside and target.exists() else None

    def _lead_to(self, link: nodes.Element, page: str) -> nodes.reference:
        uri = f"{'../' * self.env.docname.count('/')}{page}.html"
        reference = nodes.reference("", "", *link.children, internal=True, refuri=uri)
        link.replace_self(reference)
        return reference


LINKS = (addnodes.download_reference, addnodes.pending_xref)


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
