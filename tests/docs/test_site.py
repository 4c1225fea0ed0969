"""The site's settings and extensions, on a site of one page: what is dead is a warning, and nothing is fetched."""

import os
import re
from dataclasses import dataclass
from io import StringIO
from pathlib import Path

import pytest
from sphinx.application import Sphinx
from sphinx.util.docutils import docutils_namespace

ROOT = Path(__file__).parents[2]


@dataclass(frozen=True)
class Site:
    folder: Path
    warnings: str

    def html(self, page: str) -> str:
        return (self.folder / page).read_text(encoding="utf-8")


@pytest.fixture
def build(tmp_path):
    def built(text: str) -> Site:
        source, out = tmp_path / "source", tmp_path / "out"
        source.mkdir()
        (source / "index.md").write_text(f"# Title\n\n{text}\n", encoding="utf-8")
        warnings = StringIO()
        settings = {"nitpicky": True, "html_static_path": []}
        with docutils_namespace():
            app = Sphinx(
                source,
                ROOT / "docs",
                out,
                tmp_path / "trees",
                "html",
                confoverrides=settings,
                status=None,
                warning=warnings,
            )
            app.build()
        return Site(out, warnings.getvalue())

    return built


def link(tmp_path: Path, file: str) -> str:
    return Path(os.path.relpath(ROOT / file, tmp_path / "source")).as_posix()


def test_a_page_without_faults_has_no_warning_and_fetches_nothing(build):
    site = build("A cable under tension $T$.\n\n$$\nT = T_0 e^{\\mu\\varphi}\n$$ (capstan)\n\nBy {eq}`capstan`.")
    assert site.warnings == ""
    html = site.html("index.html")
    assert html.count("<math") == 2
    assert not re.findall(r'(?:src|<link[^>]* href)="(?:https?:)?//[^"]*"', html)


@pytest.mark.parametrize(
    ("text", "warning"),
    [
        ("[elsewhere](no-such-page.md)", "cross-reference target not found: 'no-such-page.md'"),
        ("[elsewhere](#no-such-heading)", "'no-such-heading'"),
        ("{py:class}`ccmodel.NoSuchClass`", "py:class reference target not found: ccmodel.NoSuchClass"),
        ("$\\nosuchcommand$", 'Unknown LaTeX command "\\nosuchcommand"'),
    ],
)
def test_what_leads_nowhere_is_a_warning(build, text, warning):
    assert warning in build(text).warnings


def test_a_link_to_a_source_leads_to_a_page_that_shows_it(build, tmp_path):
    site = build(f"[the path]({link(tmp_path, 'src/ccmodel/geometry.py')})")
    assert site.warnings == ""
    assert 'href="repository/src/ccmodel/geometry.py.html"' in site.html("index.html")
    assert "ConduitPath" in site.html("repository/src/ccmodel/geometry.py.html")


def test_a_link_to_a_folder_leads_to_a_list_of_its_files(build, tmp_path):
    site = build(f"[the model]({link(tmp_path, 'src/ccmodel/model')})")
    assert site.warnings == ""
    shown = site.html("repository/src/ccmodel/model.html")
    assert "transmission.py" in shown
    assert "__pycache__" not in shown
