"""Convert a notebook's links to page sources into links to pages, as MkDocs does for Markdown."""

import re
from typing import Any

from mkdocs.exceptions import PluginError
from mkdocs.structure.files import Files

LINK = re.compile(r'href="(?!https?:)([\w/.-]+\.(?:md|ipynb))')


def on_page_content(content: str, page: Any, files: Files, **_: Any) -> str:
    """Replace the links of a page."""
    if not page.file.src_uri.endswith(".ipynb"):
        return content

    def link(match: re.Match[str]) -> str:
        target = files.get_file_from_path(match[1])
        if target is None:
            raise PluginError(f"{page.file.src_uri} links to {match[1]}, which does not exist")
        return f'href="{target.url_relative_to(page.file)}'

    return LINK.sub(link, content)
