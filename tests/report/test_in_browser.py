"""The page in a browser (Debian's Chromium, driven by Playwright): what a reader can do with it."""

import contextlib
import re
import shutil
from dataclasses import dataclass, field
from pathlib import Path

import pytest
from made_pages import content, diagnosis, entries, summary

from ccmodel.report.page import write_page

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")
try:
    from playwright.sync_api import expect, sync_playwright
except ImportError:
    sync_playwright = None
MISSING = [name for name, there in (("Chromium", CHROMIUM), ("playwright", sync_playwright)) if not there]

pytestmark = [
    pytest.mark.skipif(bool(MISSING), reason=f"the page is not tested in a browser: {' and '.join(MISSING)} missing"),
    pytest.mark.xdist_group("browser"),
]
# Counts what a page unpacks.
COUNTING = """window.unpackings = 0;
window.DecompressionStream = class extends DecompressionStream {
  constructor(...given) { super(...given); window.unpackings += 1; }
};"""
HOSTILE = '</script><script>document.title = "taken"</script><img src=x onerror=\'document.title = "taken"\'>'


@dataclass
class Visit:
    """A page that is open, with all that it asked for and complained of."""

    page: object
    requests: list[str] = field(default_factory=list)
    complaints: list[str] = field(default_factory=list)


@pytest.fixture(scope="module")
def browser():
    with sync_playwright() as playwright:
        opened = playwright.chromium.launch(
            executable_path=CHROMIUM, args=["--no-sandbox", "--disable-background-networking", "--disable-gpu"]
        )
        yield opened
        opened.close()


@pytest.fixture(scope="module")
def file(tmp_path_factory) -> Path:
    """A page with every verdict, a batch that was not diagnosed, and a text that tries to run as a script."""
    folder = tmp_path_factory.mktemp("page")
    verdicts = ["explained", "undecided", "unexplained", "agrees", "inputs-inconsistent", None]
    diagnoses = [diagnosis(f"batch-{verdict}", verdict) for verdict in verdicts]
    batches = [summary(d["batch"], note=HOSTILE) for d in diagnoses] + [summary("not-asked", "rig")]
    (folder / "tables").mkdir()
    for name in ("errors.csv", "errors.parquet"):
        (folder / "tables" / name).touch()
    runs = entries() + [run | {"id": HOSTILE} for run in entries(1)]
    write_page(folder / "index.html", content(*diagnoses, batches=batches, runs=runs, warnings=[HOSTILE]))
    return folder / "index.html"


@contextlib.contextmanager
def visit(browser, file: Path, script: str = "", **options):
    """The page in a window of its own; `script` runs before those of the page."""
    context = browser.new_context(**{"viewport": {"width": 1280, "height": 900}} | options)
    context.add_init_script(script)
    page = context.new_page()
    seen = Visit(page)
    page.on("request", lambda request: seen.requests.append(request.url))
    page.on("pageerror", lambda error: seen.complaints.append(str(error)))
    page.on("console", lambda m: seen.complaints.append(m.text) if m.type in ("error", "warning") else None)
    page.goto(file.as_uri())
    yield seen
    context.close()


@pytest.fixture(scope="module")
def seen(browser, file):
    """The page with its viewer started."""
    with visit(browser, file) as opened:
        opened.page.locator("#viewer-box").scroll_into_view_if_needed()
        opened.page.wait_for_selector("#viewer-box[data-shown='0']")
        yield opened


def values(seen) -> list[list[str]]:
    """Rows of the table of values at the chosen time."""
    rows = seen.page.locator("#viewer-readout tbody tr")
    return [row.locator("th, td").all_inner_texts() for row in rows.all()]


def column(seen, name: str) -> list[str]:
    heads = seen.page.locator("#viewer-readout thead th").all_inner_texts()
    return [row[heads.index(name)] for row in values(seen)]


def lines(seen, figure: str):
    """Lines in a figure."""
    return seen.page.locator(f"#viewer-{figure} .scatterlayer .js-line")


def test_a_chosen_recording_is_shown(seen):
    seen.page.select_option("#viewer-run", "1")
    seen.page.wait_for_selector("#viewer-box[data-shown='1']")
    assert "run-1" in seen.page.locator("#viewer-state").inner_text()
    assert "simulated" in seen.page.locator("#viewer-state").inner_text()
    # Three channels with a recording, two models and their two residuals each.
    expect(lines(seen, "series")).to_have_count(3 * (1 + 2 * 2))
    assert seen.page.locator("#viewer-phases li").count() >= 2


def test_hovering_shows_the_values_there(seen):
    area = seen.page.locator("#viewer-series .nsewdrag").first.bounding_box()
    y = area["y"] + area["height"] / 2
    seen.page.mouse.move(area["x"] + 0.30 * area["width"], y)
    expect(seen.page.locator("#viewer-at")).to_have_text(re.compile(r"^3\.[56]"))
    before = values(seen)
    seen.page.mouse.move(area["x"] + 0.52 * area["width"], y)
    expect(seen.page.locator("#viewer-at")).to_have_text(re.compile(r"^6\.[23]"))
    assert values(seen) != before
    recorded, extended = ([float(v) for v in column(seen, name)[1:]] for name in ("recording", "extended"))
    assert extended == pytest.approx([0.99 * v for v in recorded], rel=2e-3, abs=1e-3)


def test_hovering_over_a_loop_shows_its_time(seen):
    area = seen.page.locator("#viewer-loops .nsewdrag").first
    area.scroll_into_view_if_needed()
    # Any sample of the first panel, where the page draws it.
    x, y = seen.page.evaluate("""() => {
      const figure = document.querySelector("#viewer-loops"), line = figure.data[0];
      const {xaxis, yaxis} = figure._fullLayout;
      return [xaxis.l2p(line.x[100]), yaxis.l2p(line.y[100])];
    }""")
    box = area.bounding_box()
    seen.page.mouse.move(box["x"] + x + 30, box["y"] + y)
    seen.page.mouse.move(box["x"] + x, box["y"] + y)
    shown = seen.page.locator("#viewer-at")
    expect(shown).not_to_have_text(re.compile(r"^6\.[23]"))
    time_s = float(shown.inner_text().split()[0])
    # The motion repeats every second, and the model's line is beside the recording's.
    assert abs(time_s - round(time_s)) < 0.06


def test_the_slider_shows_the_values_without_a_mouse(seen):
    seen.page.locator("#viewer-time").focus()
    seen.page.keyboard.press("Home")
    assert seen.page.locator("#viewer-at").inner_text() == "0.000 s"
    seen.page.keyboard.press("ArrowRight")
    assert seen.page.locator("#viewer-at").inner_text() == "0.020 s"


def test_a_model_is_switched_off_and_on(seen):
    before = lines(seen, "series").count(), lines(seen, "loops").count()
    box = seen.page.get_by_role("checkbox", name="extended")
    box.uncheck()
    expect(lines(seen, "series")).to_have_count(before[0] - 3 * 2)
    expect(lines(seen, "loops")).to_have_count(before[1] - 4)
    expect(seen.page.locator("#viewer-readout thead")).not_to_contain_text("extended")
    box.check()
    expect(lines(seen, "series")).to_have_count(before[0])
    expect(lines(seen, "loops")).to_have_count(before[1])


def samples_in_loops(seen) -> int:
    return seen.page.evaluate("document.querySelector('#viewer-loops').data[0].x.length")


def test_zooming_into_time_zooms_residuals_and_loops(seen):
    whole = samples_in_loops(seen)
    # The promise of a zoom covers the figures that follow from it, but for the loops, which wait for an event.
    seen.page.evaluate("Plotly.relayout('viewer-series', {'xaxis.range': [2, 4]})")
    seen.page.wait_for_timeout(500)
    assert samples_in_loops(seen) == pytest.approx(whole * 2 / 12, abs=3)
    assert seen.page.evaluate("document.querySelector('#viewer-series')._fullLayout.xaxis2.range") == [2, 4]
    seen.page.get_by_role("button", name="Whole recording").click()
    seen.page.wait_for_timeout(500)
    assert samples_in_loops(seen) == whole


def test_tensions_are_shown_on_request(seen):
    before = lines(seen, "series").count()
    seen.page.get_by_label("tensions T1 to T4").check()
    expect(lines(seen, "series")).to_have_count(before + 4 * 5)
    assert [row[0].split()[1] for row in values(seen)][-4:] == ["T1", "T2", "T3", "T4"]


def test_no_request_leaves_the_page_and_no_text_runs_as_a_script(seen, file):
    seen.page.select_option("#viewer-run", "2")
    seen.page.wait_for_selector("#viewer-box[data-shown='2']")
    assert seen.page.title() == "Recordings against the model"
    assert seen.complaints == []
    foreign = [url for url in seen.requests if not url.startswith(("data:", "blob:", file.as_uri()))]
    assert foreign == []


def test_links_lead_somewhere(seen, file):
    links = seen.page.locator("a[href]").evaluate_all("all => all.map(a => a.getAttribute('href'))")
    ids = set(seen.page.locator("[id]").evaluate_all("all => all.map(e => e.id)"))
    assert len(links) > 20
    for link in links:
        name, _, anchor = link.partition("#")
        assert (file.parent / name).exists(), link
        assert not anchor or anchor in ids, link
    every = seen.page.locator("[id]").evaluate_all("all => all.map(e => e.id)")
    assert len(every) == len(set(every)), "an id stands twice"


def test_a_card_leads_into_its_closed_diagnosis(browser, file):
    with visit(browser, file) as opened:
        report = opened.page.locator("#diagnosis-batch-explained")
        assert not report.locator("h3").is_visible()
        opened.page.locator("#card-batch-explained").get_by_role("link", name="Diagnosis").click()
        report.locator("h3").wait_for(state="visible")
        assert report.locator("h3").inner_text() == "Report of batch-explained"


def test_the_first_screen_says_what_where_and_how_much_better(browser, file):
    with visit(browser, file) as opened:
        card = opened.page.locator("#card-batch-explained")
        box = card.bounding_box()
        assert box["y"] + box["height"] <= 900
        text = card.inner_text()
        assert "dead zone of ±30.1 mrad (29.2 to 30.9 mrad), confidence 0.97" in text
        assert "6.0 → 1.2" in text
        assert "simulated" in text
        assert card.get_by_role("img", name="place of the mismatch: load pulley").count() == 1


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_a_telephone_shows_the_page_without_scrolling_sideways(browser, file, scheme):
    with visit(browser, file, viewport={"width": 390, "height": 844}, color_scheme=scheme) as opened:
        opened.page.locator("#viewer-box").scroll_into_view_if_needed()
        opened.page.wait_for_selector("#viewer-box[data-shown='0']")
        opened.page.evaluate("document.querySelectorAll('details').forEach(d => { d.open = true; })")
        assert opened.page.evaluate("document.documentElement.scrollWidth") <= 390
        background = opened.page.evaluate("getComputedStyle(document.body).backgroundColor")
        assert (background == "rgb(255, 255, 255)") == (scheme == "light")


def test_the_keyboard_finds_the_verdicts_first(browser, file):
    with visit(browser, file) as opened:
        opened.page.keyboard.press("Tab")
        assert opened.page.evaluate("document.activeElement.getAttribute('href')") == "#verdicts"
        assert opened.page.evaluate("getComputedStyle(document.activeElement).outlineStyle") == "solid"


def test_every_table_has_a_caption_and_every_picture_a_text(seen):
    assert seen.page.locator("table:not(:has(caption))").count() == 0
    assert seen.page.locator("img:not([alt]), img[alt='']").count() == 0
    assert seen.page.locator("th:not([scope])").count() == 0


def test_two_hundred_recordings_open_like_one(browser, tmp_path):
    """The page has two elements more for each recording, and unpacks nothing until the viewer comes into view."""
    one, opened_with = entries(1, noise=0.1)[0], {}
    assert len(one["data"]) > 25_000, "as large as that of a recording with load cells"
    for count in (1, 200):
        file = tmp_path / f"{count}.html"
        runs = [one | {"id": f"run-{k}"} for k in range(count)]
        write_page(file, content(diagnosis("b", "explained"), runs=runs))
        with visit(browser, file, script=COUNTING, viewport={"width": 1280, "height": 200}) as opened:
            elements = opened.page.evaluate("document.querySelectorAll('*').length")
            opened_with[count] = (elements, file.stat().st_size)
            assert opened.page.locator("#viewer-run option").count() == count
            assert opened.page.evaluate("[unpackings, typeof Plotly]") == [0, "undefined"]
            opened.page.locator("#viewer-box").scroll_into_view_if_needed()
            opened.page.wait_for_selector("#viewer-box[data-shown='0']")
            assert opened.page.evaluate("unpackings") == 2, "the library and the recording that is shown"
    (few, small), (many, large) = opened_with[1], opened_with[200]
    assert many - few == 2 * 199
    assert large - small < 199 * (len(one["data"]) + 200)
