"""Pages load nothing from elsewhere: what notebooks bring along goes, all else is an error."""

import re
from typing import Any

from mkdocs.exceptions import PluginError

LOADED = re.compile(
    r"<!-- Load mathjax -->.*?<!-- End of mathjax configuration -->"
    r'|<script type="module">(?:(?!</script>).)*mermaid.*?</script>',
    re.DOTALL,
)
"""Typesetting of TeX and of diagrams, of which our notebooks have none."""

ELSEWHERE = re.compile(
    r"""(?:src=|import\(|@import |url\(|<link [^>]*href=)["']?(https?:[^"')>]*)"""
)


def on_post_page(output: str, page: Any, **_: Any) -> str:
    """Clean and check a finished page; see MkDocs on hooks."""
    output = LOADED.sub("", output)
    if found := ELSEWHERE.search(output):
        raise PluginError(f"{page.file.src_uri} loads {found[1]}")
    return output
