"""Texts that try to run in the browser, in every place of a batch, a model and a configuration that a page shows.

No element and no attribute of a page comes from them, and each is shown as it is written.
"""

import re
import shutil
import subprocess
from html.parser import HTMLParser

import pandas as pd
import pytest
from made_pages import content, diagnosis, entries, run, summary
from matplotlib.figure import Figure

from ccmodel.errors import COLUMNS
from ccmodel.inference.fit import FitResult
from ccmodel.inference.intervals import Interval, Scatter, Undetermined
from ccmodel.report.page import write_page
from ccmodel.studies.diagnosis.page import write_inconsistent, write_not_diagnosed

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
RAN = "document.documentElement.dataset.ran = 1"
HOSTILE = (
    f"""<script>{RAN}</script><img src=x onerror="{RAN}">"></svg><script>{RAN}</script>' onfocus='{RAN}' autofocus='"""
    f"""</title></textarea><svg onload="{RAN}"><a href="javascript:{RAN}">a</a>"""
    """{{7*7}}{% raw %}${7*7}]]>--><!--\u202e&lt;b&gt;"""
)


class Texts:
    """Texts of which none is like another: hostile ones, or as many plain ones."""

    def __init__(self, payload: str):
        self.payload, self.made = payload, []

    def __call__(self, place: str) -> str:
        self.made.append(f"{self.payload}[{place}]")
        return self.made[-1]


class Elements(HTMLParser):
    """Elements of a page with their attributes, and its text."""

    def __init__(self, html: str):
        super().__init__(convert_charrefs=True)
        self.found, self.shown, self.values, self._inside = [], [], [], []
        self.feed(html)
        self.close()

    def handle_starttag(self, tag, attributes):
        self.found.append((tag, tuple(name for name, _ in attributes)))
        self.values += [(name, value or "") for name, value in attributes]
        self._inside = [tag] if tag in ("script", "style") else []

    def handle_endtag(self, tag):
        self._inside = []

    def handle_data(self, data):
        if not self._inside:
            self.shown.append(data)

    def text(self) -> str:
        return "".join(self.shown)


def hostile_fit(text: Texts) -> dict:
    one = text("recording of a fit")
    result = FitResult(
        succeeded=True, message=text("message of a fit"), values={text("parameter"): 1.0}, intervals={}, profiles={},
        own={one: {"friction_scale": 1.0}}, own_intervals={one: {"friction_scale": Interval.about(1.0, 0.1)}},
        scatter={"friction_scale": Scatter(0.1, 0.1, 0.2)}, resampled={},
        undetermined=[Undetermined(["a", "b"], text("what is not determined"))], warnings=[text("warning of a fit")],
        recordings=[one],
    )  # fmt: skip
    made = result.as_dict()
    made["intervals"] = {name: {"low": 0.9, "high": 1.1, "sd": 0.1} for name in made["values"]}
    return {"fit": text("name of a fit"), **made}


def errors(text: Texts) -> pd.DataFrame:
    row = dict.fromkeys(COLUMNS, 1.0) | {"samples": 10, "origin": "rig", "channel": "theta_out_rad"}
    row |= {name: text(f"{name} of an error") for name in ("batch", "recording", "parameters", "unit")}
    return pd.DataFrame([row])[list(COLUMNS)].astype(COLUMNS)


def write_pages(folder, text: Texts):
    """The page of a run, and the pages of batches without a verdict and with inputs that contradict one another."""
    (folder / "figures").mkdir(parents=True)
    for ending in ("png", "svg", "pdf"):
        Figure((1, 1)).savefig(folder / f"figures/study.{ending}")
    explained, undiagnosed, wrong = (text(f"name of batch {k}") for k in (1, 2, 3))
    diagnoses = [
        diagnosis(explained, "explained"),
        diagnosis(undiagnosed, None, why=text("why a batch is not diagnosed")),
        diagnosis(wrong, "inputs-inconsistent"),
    ]
    diagnoses[2]["next_experiment"] = {"text": text("what to correct"), "separates": []}
    diagnoses[2]["not_judged"] = [{"what": text("what contradicts"), "why": text("why it does"), "confidence": 1.0}]
    write_not_diagnosed(folder / "not-diagnosed.html", undiagnosed, diagnoses[1]["why"], "index.html")
    recording = run(text("recording that was read"))[0]
    write_inconsistent(folder / "inconsistent.html", diagnoses[2], [recording], "index.html")
    reports = {explained: "<main><h1>Report</h1></main>"}
    reports |= {undiagnosed: (folder / "not-diagnosed.html").read_text()}
    reports |= {wrong: (folder / "inconsistent.html").read_text()}
    runs = [entries(1)[0] | {"id": text("recording of the viewer"), "batch": explained}]
    settings = {"title": text("title of a study"), "batches": [text("batch of a study")]}
    study = {"kind": "loops", "name": "study", "heading": "Figures", "settings": settings}
    page = content(
        *diagnoses, batches=[summary(d["batch"], note=text("note")) for d in diagnoses], reports=reports, runs=runs,
        errors=errors(text), fits=[hostile_fit(text)], left_out=[text("left out")],
        inconsistent=[text("inconsistent")], warnings=[text("warning")],
        studies=[study | {"parameters": text("parameters of a study")}],
    )  # fmt: skip
    write_page(folder / "index.html", page)
    return [folder / name for name in ("index.html", "not-diagnosed.html", "inconsistent.html")]


@pytest.fixture(scope="module")
def pages(tmp_path_factory):
    """Pages with hostile texts, the texts, and the same pages with plain ones."""
    folder, hostile = tmp_path_factory.mktemp("pages"), Texts(HOSTILE)
    written = write_pages(folder / "hostile", hostile)
    return written, hostile.made, write_pages(folder / "plain", Texts("plain"))


def flat(text: str) -> str:
    return re.sub(r"\s+", " ", text)


def test_no_element_and_no_attribute_comes_from_a_text(pages):
    for hostile, plain in zip(pages[0], pages[2], strict=True):
        found, expected = (Elements(file.read_text(encoding="utf-8")) for file in (hostile, plain))
        assert found.found == expected.found
        links = [value for name, value in found.values if name in ("href", "src", "action", "formaction", "data")]
        assert not [link for link in links if link.strip().lower().startswith("javascript:")]


def test_each_text_is_shown_as_it_is_written(pages):
    shown = flat("".join(Elements(file.read_text(encoding="utf-8")).text() for file in pages[0]))
    missing = [text for text in pages[1] if flat(text) not in shown]
    assert len(pages[1]) > 20 and missing == []


@pytest.mark.skipif(CHROMIUM is None, reason="the pages are not opened in a browser: Chromium is missing")
def test_no_text_runs_in_a_browser(pages, tmp_path):
    shown = ""
    for file in pages[0]:
        # A window as high as the page, so that what is drawn once it is seen is drawn.
        command = [
            CHROMIUM, "--headless", "--no-sandbox", "--disable-gpu", f"--user-data-dir={tmp_path / 'profile'}",
            "--window-size=1280,12000", "--virtual-time-budget=5000", "--dump-dom", file.as_uri(),
        ]  # fmt: skip
        page = subprocess.run(command, capture_output=True, encoding="utf-8", check=True, timeout=120).stdout
        found = Elements(page)
        assert found.found, "the browser shows nothing"
        assert "data-ran" not in dict(found.values)
        assert not [tag for tag, names in found.found if {"onerror", "onload", "onfocus", "autofocus"} & {*names}]
        shown += found.text()
    assert [text for text in pages[1] if flat(text) not in flat(shown)] == []


@pytest.mark.skipif(CHROMIUM is None, reason="the pages are not opened in a browser: Chromium is missing")
def test_a_text_that_is_not_escaped_would_run(tmp_path):
    file = tmp_path / "page.html"
    file.write_text(f"<!DOCTYPE html><title>a</title><p>{HOSTILE}</p>", encoding="utf-8")
    command = [CHROMIUM, "--headless", "--no-sandbox", "--disable-gpu", f"--user-data-dir={tmp_path / 'profile'}"]
    command += ["--virtual-time-budget=2000", "--dump-dom", file.as_uri()]
    page = subprocess.run(command, capture_output=True, encoding="utf-8", check=True, timeout=120).stdout
    assert "data-ran" in dict(Elements(page).values)
