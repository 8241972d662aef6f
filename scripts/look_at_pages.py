"""Look at pages in a real browser, at the width of a desk and of a telephone.

    python scripts/look_at_pages.py results/site report.html -o results/looked_at
    python scripts/look_at_pages.py report.html --beside report.png

A folder stands for every .html file below it but 404.html, which only a server shows, and pages that lead
on to another. Of each page and width it says: what is wider than the page and does not scroll by itself,
words that look like keys (snake_case outside code, but the package's name), what failed to load, what the
page's scripts complain of.
-o DIR gets a picture of each. The exit status is 1 where there is anything to say. --beside gets one
picture of a report instead: light on a desk, dark on a telephone, the robot turned by hand. With --after
PICTURE.png it shows that picture, and after it the top of the report on a desk.

Needs Playwright for Python (`pip install playwright`) and Chromium, its own or the system's.
"""

from __future__ import annotations

import argparse
import io
import shutil
import sys
from pathlib import Path

import numpy as np
from PIL import Image

WIDTHS = (1400, 390)  # a desk's and a telephone's, in CSS pixels
HEIGHT = 900
BESIDE = ((920, "light"), (390, "dark"))  # widths and schemes of `--beside`
BESIDE_HEIGHT, BETWEEN = 1500, 40  # of that picture, and of the gap in it [px]
AFTER = ((940, "light"),)  # the same of `--after`
AFTER_SHARE = 0.75  # of its size, so that more of the report is beside the picture
GAP = (221, 226, 230)  # its colour
TALLEST = 16000  # of a picture: a browser draws no larger one
# What sticks out to the right of the page although nothing around it scrolls or cuts it off.
TOO_WIDE = """() => {
  const width = document.documentElement.clientWidth, found = [];
  for (const element of document.querySelectorAll('body *')) {
    const box = element.getBoundingClientRect();
    if (box.width === 0 || box.right <= width + 1) continue;
    let around = element.parentElement, held = getComputedStyle(element).position === 'fixed';
    for (; around && !held; around = around.parentElement) {
      const style = getComputedStyle(around);
      held = style.overflowX !== 'visible' && around.tagName !== 'BODY' && around.tagName !== 'HTML'
        || style.position === 'fixed';
    }
    if (!held) found.push(`${element.tagName.toLowerCase()} to ${Math.round(box.right)} px`);
  }
  const whole = document.documentElement.scrollWidth;
  if (whole > width) found.push(`page ${whole} px`);
  return [...new Set(found)];
}"""
RAW_KEYS = r"""() => {
  const walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT), found = new Set();
  while (walker.nextNode()) {
    const around = walker.currentNode.parentElement;
    if (!around || around.closest('code, pre, option, script, style, .highlight, nav')) continue;
    const words = walker.currentNode.data.match(/\b[a-z][a-z0-9]*(_[a-z0-9]+)+\b/g) || [];
    for (const word of words) if (word !== 'catheter_sim') found.add(word);
  }
  return [...found];
}"""


def pages_of(names: list[str]) -> list[Path]:
    """Return the pages that the arguments name.

    Raises:
        SystemExit: with 2, where there is no such page.
    """
    found: list[Path] = []
    for name in names:
        path = Path(name).resolve()
        found_there = sorted(set(path.rglob("*.html")) - {path / "404.html"})
        pages = [path] if path.is_file() else [page for page in found_there if not _leads_on(page)]
        if not pages:
            print(f"look_at_pages: {name}: no page there", file=sys.stderr)
            raise SystemExit(2)
        found += pages
    return found


def _leads_on(page: Path) -> bool:
    return 'http-equiv="refresh"' in page.read_text(encoding="utf-8")[:1000]


def main() -> int:
    """Look; return the exit status."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("page", nargs="+", metavar="PAGE", help=".html file, or a folder of them")
    where = parser.add_mutually_exclusive_group(required=True)
    where.add_argument("-o", "--output", metavar="DIR", help="folder for the pictures")
    where.add_argument("--beside", metavar="OUT.png", help="one picture of one report, at both widths")
    parser.add_argument(
        "--after", metavar="PICTURE.png", help="with --beside: the report's top after a picture"
    )
    options = parser.parse_args()
    try:
        from playwright.sync_api import sync_playwright
    except ImportError:
        print("look_at_pages: needs playwright: pip install playwright", file=sys.stderr)
        return 2
    pages = pages_of(options.page)
    if options.output is not None:
        Path(options.output).mkdir(parents=True, exist_ok=True)
    said = 0
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(
            executable_path=shutil.which("chromium") or shutil.which("google-chrome"), args=["--no-sandbox"]
        )
        if options.beside is not None:
            _draw_beside(browser, pages[0], Path(options.beside), options.after)
            browser.close()
            return 0
        for path in pages:
            for width in WIDTHS:
                words = _looked_at(browser, path, width, Path(options.output))
                said += bool(words)
                print(f"{path.parent.name}/{path.name} at {width}: {'; '.join(words) or 'well'}", flush=True)
        browser.close()
    print(f"{len(pages)} pages at {len(WIDTHS)} widths: {said} with something to say")
    return 1 if said else 0


def _looked_at(browser, path: Path, width: int, folder: Path) -> list[str]:
    page = browser.new_page(viewport={"width": width, "height": HEIGHT})
    words: list[str] = []
    page.on("pageerror", lambda error: words.append(f"script: {error}"))
    page.on("requestfailed", lambda request: words.append(f"not loaded: {request.url.rpartition('/')[2]}"))
    page.goto(path.as_uri(), wait_until="load")
    wide, keys = page.evaluate(TOO_WIDE), page.evaluate(RAW_KEYS)
    words += [f"too wide: {', '.join(wide[:5])}"] if wide else []
    words += [f"keys: {', '.join(keys[:8])}"] if keys else []
    height = min(page.evaluate("document.documentElement.scrollHeight"), TALLEST)
    name = f"{path.parent.name}_{path.stem}_{width}.png"
    clip = {"x": 0, "y": 0, "width": width, "height": height}
    page.screenshot(path=folder / name, clip=clip, full_page=True)
    page.close()
    return words


def _draw_beside(browser, path: Path, out: Path, after: str | None) -> None:
    """Write a picture of a report's top, the robot turned by the mouse: at two widths, or after a picture."""
    parts = [] if after is None else [np.asarray(Image.open(after).convert("RGB"))]
    height = len(parts[0]) if parts else BESIDE_HEIGHT
    for width, scheme in AFTER if parts else BESIDE:
        size = {"width": width, "height": round(height / AFTER_SHARE) if after else height}
        page = browser.new_page(viewport=size, color_scheme=scheme)
        page.goto(path.as_uri(), wait_until="load")
        box = page.locator("#space-canvas").bounding_box()
        x, y = box["x"] + 0.5 * box["width"], box["y"] + 0.5 * box["height"]
        page.mouse.move(x, y)
        page.mouse.down()
        page.mouse.move(x + 60, y + 25, steps=4)
        page.mouse.up()
        page.mouse.move(5, 5)
        shot = Image.open(io.BytesIO(page.screenshot())).convert("RGB")
        image = np.asarray(shot.resize((round(width * AFTER_SHARE), height)) if after else shot)
        gap = np.full((height, BETWEEN, 3), GAP, np.uint8)
        parts += [gap, image] if parts else [image]
        page.close()
    picture = Image.fromarray(np.hstack(parts)).quantize(128, dither=Image.Dither.NONE)
    picture.save(out, optimize=True)
    print(f"wrote {out}: {picture.width} x {picture.height} pixels")


if __name__ == "__main__":
    sys.exit(main())
