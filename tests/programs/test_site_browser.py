"""The documentation site, as `make docs` built it, in a browser: on a desktop and on a phone."""

import functools
import posixpath
import re
import threading
from collections import defaultdict
from collections.abc import Iterator
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

import pytest
from browser import DESKTOP, PHONE

ROOT = Path(__file__).parents[2]
SITE = ROOT / "out" / "site"

PARTS = "docs/**/*", "src/magmotor/**/*.py", "*.md", "LICENSE", "CITATION.cff", "mkdocs.yml"
SOURCES = [path for part in PARTS for path in ROOT.glob(part) if path.is_file()]


@pytest.fixture(scope="module", autouse=True)
def built():
    """Skip the tests if there is no site, or an older one than its sources."""
    home = SITE / "index.html"
    if not home.exists():
        pytest.skip("no out/site: run make docs")
    newer = [path for path in SOURCES if path.stat().st_mtime > home.stat().st_mtime]
    if newer:
        pytest.skip(f"out/site is older than {newer[0].relative_to(ROOT)}: run make docs")


class Server(SimpleHTTPRequestHandler):
    """Serves the site below the folder /deep/er/, and 404.html for what is missing."""

    def translate_path(self, path: str) -> str:
        """Return the file of an address."""
        inside = path.split("?", maxsplit=1)[0].partition("/deep/er/")[2]
        return super().translate_path(f"/{inside or 'missing'}")

    def send_error(self, code: int, message: str | None = None, explain: str | None = None) -> None:
        """Send the page for missing ones."""
        self.send_response(code)
        self.send_header("Content-Type", "text/html")
        self.end_headers()
        self.wfile.write((SITE / "404.html").read_bytes())

    def log_message(self, format: str, *args: object) -> None:
        """Print nothing."""


@pytest.fixture(scope="module")
def address() -> Iterator[str]:
    """Serve the site, and yield the address of its first folder."""
    server = ThreadingHTTPServer(("127.0.0.1", 0), functools.partial(Server, directory=str(SITE)))
    threading.Thread(target=server.serve_forever, daemon=True).start()
    yield f"http://127.0.0.1:{server.server_port}/deep/er/"
    server.shutdown()
    server.server_close()


def pages() -> list[str]:
    return sorted(path.relative_to(SITE).as_posix() for path in SITE.rglob("*.html"))


@pytest.mark.slow
def test_every_page_loads_without_an_error_and_fits_both_screens(browser, address):
    sizes = [dict(zip(("width", "height"), size, strict=True)) for size in (DESKTOP, PHONE)]
    page, wrong = browser.new_page(), defaultdict(list)
    page.set_default_timeout(120_000)
    # Each page reads the index, which is large. The search has a test of its own.
    index = '__index = {"config": {"lang": ["en"], "separator": " ", "pipeline": []}, "docs": []}'
    page.route("**/search_index.js", lambda route: route.fulfill(body=f"var {index}"))

    def failed(request):
        if request.failure != "net::ERR_ABORTED":  # by going on to the next page
            wrong[page.url].append(f"{request.url}: {request.failure}")

    def requested(request):
        if not request.url.startswith((address, "data:", "blob:")):
            wrong[page.url].append(f"loads {request.url}")

    page.on("pageerror", lambda error: wrong[page.url].append(str(error)))
    page.on("console", lambda said: said.type == "error" and wrong[page.url].append(said.text))
    page.on("request", requested)
    page.on("requestfailed", failed)
    for name in pages():
        page.set_viewport_size(sizes[0])
        page.goto(address + name)
        for size in sizes:
            page.set_viewport_size(size)
            beyond = page.evaluate("document.documentElement.scrollWidth - innerWidth")
            if beyond > 0:
                wrong[page.url].append(f"{size['width']}: scrolls sideways by {beyond} pixels")
        if page.locator("h1").count() != 1:
            wrong[page.url].append("has not one title")
    page.close()
    assert not wrong


def test_links_and_anchors_of_the_built_pages_hold():
    text = {name: (SITE / name).read_text(encoding="utf-8") for name in pages()}
    ids = {name: set(re.findall(r'\bid="([^"]+)"', html)) for name, html in text.items()}
    broken = []
    for name, html in text.items():
        for link in re.findall(r'(?:href|src)="([^":]+)"', html.replace("&amp;", "&")):
            path, _, anchor = link.partition("#")
            folder = posixpath.dirname(name)
            target = posixpath.normpath(posixpath.join(folder, path)) if path else name
            lost = anchor and target in ids and anchor not in ids[target]
            if lost or not (SITE / target).exists():
                broken.append(f"{name}: {link}")
    assert not broken


def test_search_finds_terms_questions_and_messages_among_the_first_results(open_page, address):
    page, wrong = open_page(address + "index.html"), []
    results = page.locator(".md-search-result__item")
    for words, found in (
        ("momentum map", "glossary.html"),
        ("labmaze", "install.html"),
        ("NoOpenGL", "faq.html#noopengl"),
        ("plugin magmotor.forces not found", "faq.html#xml-error-plugin-magmotorforces-not-found"),
        ("directory must be empty", "faq.html#directory-must-be-empty-or-hold-this-sweep"),
        ("nothing moves", "faq.html#nothing-moves"),
        ("explodes", "faq.html#it-explodes-or-magnets-fly-apart"),
        ("which timestep", "advice.html"),
        ("cache", "faq.html#may-i-delete-the-cache"),
        ("import order", "faq.html#import-order"),
        ("GPU", "faq.html#does-it-use-the-gpu"),
        ("Windows", "faq.html#windows-macos"),
        ("macOS", "faq.html#windows-macos"),
    ):
        for text, state in (("", "detached"), (words, "attached")):
            page.locator("input.md-search__input").fill(text)
            page.keyboard.press("End")  # the search waits for a key
            results.first.wait_for(state=state)
        links = results.evaluate_all(
            "items => items.slice(0, 2).flatMap(item => [...item.querySelectorAll('a')])"
            ".filter(link => link.checkVisibility())"
            ".map(link => link.getAttribute('href'))"
        )
        if not any(found in link for link in links):
            wrong.append(f"{words}: {links[:5]}")
    assert not wrong


def test_the_icon_of_a_page_is_the_project_s(open_page, address):
    page = open_page(address + "api/scenes.html")
    links = page.locator('link[rel~="icon"]')
    assert links.count() == 1
    answer = page.request.get(links.evaluate("link => link.href"))
    assert answer.status == 200
    assert answer.headers["content-type"] == "image/svg+xml"
    assert answer.body() == (ROOT / "docs" / "magmotor.svg").read_bytes()


def test_colors_follow_the_system_until_chosen_and_again_when_asked(open_page, address):
    page = open_page(address + "install.html")

    def shows(expected, then=None):
        page.wait_for_function(
            "name => document.body.getAttribute('data-md-color-scheme') === name", arg=expected
        )
        if then:
            page.locator(f'label[title="{then}"]:visible').click()

    page.emulate_media(color_scheme="dark")
    shows("slate")  # follows the system, also on the next visit
    page.reload()
    page.emulate_media(color_scheme="light")
    shows("default", then="Colors of the system; switch to light")
    page.emulate_media(color_scheme="dark")
    shows("default")  # chosen
    page.goto(address + "api/scenes.html")
    shows("default", then="Light; switch to dark")
    shows("slate", then="Dark; switch to the colors of the system")
    page.emulate_media(color_scheme="light")
    shows("default")
    page.reload()
    page.emulate_media(color_scheme="dark")
    shows("slate")


@pytest.mark.parametrize("missing", ["missing.html", "api/x/y/missing.html", "faq/"])
def test_the_page_for_missing_ones_leads_back_from_any_depth(browser, address, missing):
    context = browser.new_context()
    page = context.new_page()
    answer = page.goto(address + missing)
    assert answer.status == 404
    page.get_by_role("link", name="FAQ").wait_for()
    assert not page.get_by_text("Without JavaScript").is_visible()
    page.get_by_role("link", name="FAQ").click()
    page.wait_for_load_state()
    assert page.url == f"{address}faq.html"
    context.close()


def test_without_scripts_the_page_for_missing_ones_says_why_it_has_no_links(browser, address):
    context = browser.new_context(java_script_enabled=False)
    page = context.new_page()
    page.goto(address + "api/missing.html")
    assert page.get_by_text("Without JavaScript").is_visible()
    assert page.get_by_role("link").count() == 0
    context.close()


def test_the_menu_of_a_phone_leads_to_a_page(open_page, address):
    page = open_page(address + "index.html", PHONE)
    page.locator('label.md-header__button[for="__drawer"]').click()
    page.locator('label.md-nav__title[for="__nav_1"]').click()  # from this section to all
    page.locator("#__nav_3_label").click()
    page.locator(".md-nav--primary").get_by_role("link", name="Observables").click()
    page.wait_for_load_state()
    assert page.url == f"{address}api/observables.html"


def test_the_gallery_s_small_pictures_lead_to_its_figures(open_page, address):
    page = open_page(address + "gallery.html")
    small = page.locator(".thumbnails a")
    figures = page.locator("article > p > img")
    assert small.count() == figures.count() == len([*(ROOT / "docs" / "gallery").glob("*.json")])
    assert all(box["width"] < 250 for box in (one.bounding_box() for one in small.all()[:5]))
    small.last.click()
    page.wait_for_function("scrollY > 1000")


def test_the_footer_names_version_license_and_citation(open_page, address):
    page = open_page(address + "api/scenes.html")
    footer = page.locator("footer").inner_text()
    assert re.search(r"magmotor \d+\.\d+", footer)
    page.get_by_role("link", name="Citation and BibTeX").click()
    page.wait_for_load_state()
    assert page.url == f"{address}citing.html"
    assert "0710.1565" in page.content()
