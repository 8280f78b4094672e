"""The pages are built without a warning, and work without a network."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from tests.conftest import PHONE

if TYPE_CHECKING:
    from playwright.sync_api import Browser

pytestmark = pytest.mark.slow  # the reference is parsed from the sources
ROOT = Path(__file__).resolve().parents[2]
LOADED = re.compile(
    r"<(?:script|img|iframe)[^>]*\bsrc=[\"']?(?:https?:)?//|<link(?![^>]*canonical)[^>]*href=[\"']?(?:https?:)?//"
)
"""What a browser would fetch from elsewhere; links that somebody may follow are no part of it."""


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    pytest.importorskip("mkdocs", reason="pip install '.[docs]' brings mkdocs")
    folder = tmp_path_factory.mktemp("site")
    done = subprocess.run(
        [sys.executable, "-m", "mkdocs", "build", "--strict", "--site-dir", str(folder)],
        cwd=ROOT, env=os.environ | {"NO_MKDOCS_2_WARNING": "1"}, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert "WARNING" not in done.stderr
    return folder


def test_pages_load_nothing_from_elsewhere(site: Path) -> None:
    pages = list(site.rglob("*.html"))
    assert len(pages) > 20
    for page in pages:
        found = LOADED.search(page.read_text(encoding="utf-8"))
        assert found is None, f"{page.relative_to(site)}: {found and found[0]}"


def test_pages_for_the_disk_promise_no_search(site: Path) -> None:
    """Browsers run no scripts of local pages; `make site` has the search."""
    assert 'data-md-component="search"' not in (site / "index.html").read_text(encoding="utf-8")


@pytest.mark.render
@pytest.mark.parametrize(
    "page",
    [
        "chassis_control",
        "controller_results",
        "claims",
        "claims_other_cars",
        "gallery",
        "manoeuvre_keys",
        "reference/vehicle",
    ],
)
def test_pages_are_no_wider_than_a_telephone(site: Path, browser: Browser, page: str) -> None:
    """Wide tables and code scroll by themselves; the title, which slides in at the top, is cut."""
    context = browser.new_context(**PHONE)
    shown = context.new_page()
    shown.goto((site / f"{page}.html").as_uri())
    for place in ("0", "document.body.scrollHeight / 2"):
        shown.evaluate(f"scrollTo(0, {place})")
        assert shown.evaluate("document.documentElement.scrollWidth") == PHONE["viewport"]["width"]
    context.close()
