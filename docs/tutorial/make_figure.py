"""The tutorial's screenshot: ``python docs/tutorial/make_figure.py``, after the tutorial's diagnosis.

Needs Debian's Chromium, which Playwright drives.
"""

import argparse
import shutil
from pathlib import Path

from playwright.sync_api import sync_playwright

ROOT = Path(__file__).parents[2]
SIZE = {"width": 1100, "height": 1215}


def main() -> None:
    """Open the report and take a picture of its top."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--report", type=Path, default=ROOT / "my-rig/diagnosis/report.html")
    parser.add_argument("--out", type=Path, default=ROOT / "docs/figures/tutorial-report.png")
    given = parser.parse_args()
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=shutil.which("chromium"), args=["--no-sandbox"])
        page = browser.new_page(viewport=SIZE)
        page.goto(given.report.resolve().as_uri())
        page.screenshot(path=given.out)
        browser.close()


if __name__ == "__main__":
    main()
