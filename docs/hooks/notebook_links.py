"""Links of notebooks to other pages' sources, made links to the pages as those of Markdown are."""

import re
from typing import Any

from mkdocs.exceptions import PluginError
from mkdocs.structure.files import Files

LINK = re.compile(r'href="(?!https?:)([\w/.-]+\.(?:md|ipynb))')


def on_page_content(content: str, page: Any, files: Files, **_: Any) -> str:
    """Replace those of a page."""
    if not page.file.src_uri.endswith(".ipynb"):
        return content

    def link(found: re.Match[str]) -> str:
        target = files.get_file_from_path(found[1])
        if target is None:
            raise PluginError(f"{page.file.src_uri} links to {found[1]}, which there is not")
        return f'href="{target.url_relative_to(page.file)}'

    return LINK.sub(link, content)
