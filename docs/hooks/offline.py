"""Remove what notebooks load from other sites; anything else loaded from there is an error."""

import re
from typing import Any

from mkdocs.exceptions import PluginError

LOADED = re.compile(
    r"<!-- Load mathjax -->.*?<!-- End of mathjax configuration -->"
    r'|<script type="module">(?:(?!</script>).)*mermaid.*?</script>',
    re.DOTALL,
)
"""Scripts for TeX and diagrams, which our notebooks do not contain."""

ELSEWHERE = re.compile(
    r"""(?:src=|import\(|@import |url\(|<link [^>]*href=)["']?(https?:[^"')>]*)"""
)


def on_post_page(output: str, page: Any, **_: Any) -> str:
    """Clean and check a finished page."""
    output = LOADED.sub("", output)
    if found := ELSEWHERE.search(output):
        raise PluginError(f"{page.file.src_uri} loads {found[1]}")
    return output
