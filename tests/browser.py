"""A headless Chromium in which tests open pages."""

import shutil

import pytest

NAMES = "chromium", "chromium-browser", "google-chrome", "google-chrome-stable"
"""Programs that serve, the first one that is installed."""

OPTIONS = [
    "--no-sandbox",  # as root
    "--no-proxy-server",
    "--use-gl=angle",  # WebGL without a graphics card
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
]

DESKTOP, PHONE = (1400, 900), (390, 844)
"""Sizes of a page in pixels."""


# It ends with each module: while Playwright runs, no other event loop can run in this thread.
@pytest.fixture(scope="module")
def browser():
    """Yield a Playwright browser; skip the tests where it is not installed."""
    programs = [path for name in NAMES if (path := shutil.which(name))]
    if not programs:
        pytest.skip("no Chromium: install chromium (Debian, Fedora)")
    sync_api = pytest.importorskip("playwright.sync_api", reason="no Playwright: pip install it")
    with sync_api.sync_playwright() as playwright:
        chromium = playwright.chromium.launch(executable_path=programs[0], args=OPTIONS)
        yield chromium
        chromium.close()


@pytest.fixture
def open_page(browser):
    """Return a function that opens an address in a page of a size in pixels.

    A script of the test's own may run before those of the page. After the test, an error in one of
    its pages' scripts fails it.
    """
    contexts, errors = [], []

    def opened(address, size=DESKTOP, script=""):
        width, height = size
        context = browser.new_context(viewport={"width": width, "height": height})
        context.set_default_timeout(120_000)
        contexts.append(context)
        page = context.new_page()
        page.add_init_script(script)
        page.on("pageerror", lambda error: errors.append(f"{address}: {error}"))
        page.goto(address)
        return page

    yield opened
    for context in contexts:
        context.close()
    assert not errors
