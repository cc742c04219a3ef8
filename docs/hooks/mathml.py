"""Formulas as MathML, which browsers render without scripts or network access."""

import html
import re
import unicodedata
from typing import Any

from latex2mathml.converter import convert
from mkdocs.exceptions import PluginError

FORMULA = re.compile(r'<(span|div) class="arithmatex">\\[(\[](.*?)\\[)\]]</\1>', re.DOTALL)
"""The output of arithmatex for TeX between dollar signs."""

STYLES = {"bold": "BOLD", "bold-italic": "BOLD ITALIC", "double-struck": "DOUBLE-STRUCK"}
STYLED = re.compile(rf'<mi mathvariant="({"|".join(STYLES)})">(&#x\w+;|\w)</mi>')
UNKNOWN = re.compile(r'\\|mathvariant="(?!normal)')
"""TeX that latex2mathml did not convert, and letter styles that browsers do not support."""

CODE = re.compile(r"<(pre|code)\b.*?</\1>", re.DOTALL)


def on_page_content(content: str, page: Any, **_: Any) -> str:
    """Replace the formulas of a page; raise if one cannot be converted."""
    page_name = page.file.src_uri
    if not page_name.endswith(".md"):
        return content
    content = FORMULA.sub(lambda match: mathml(match, page_name), content)
    if left := re.search(r".{0,40}\$.{0,40}", CODE.sub("", content)):
        raise PluginError(f"{page_name}: unmatched dollar sign in {left[0]!r}")
    return content


def mathml(match: re.Match[str], page_name: str) -> str:
    """Convert one formula."""
    tex = html.unescape(match[2])
    try:
        formula = convert(tex, display="block" if match[1] == "div" else "inline")
    except Exception as failure:  # latex2mathml has many exception classes
        raise PluginError(f"{page_name}: {tex!r}: {failure!r}") from failure
    formula = STYLED.sub(lambda letter: f"<mi>{styled(*letter.groups())}</mi>", formula)
    if UNKNOWN.search(formula):
        raise PluginError(f"{page_name}: {tex!r}: MathML cannot express all of it")
    return formula


def styled(style: str, letter: str) -> str:
    """Return the Unicode character of a Latin or Greek letter in a style."""
    _, case, _, letter = unicodedata.name(html.unescape(letter)).split()
    name = f"{STYLES[style]} {case} {letter}"
    try:
        return unicodedata.lookup(f"MATHEMATICAL {name}")
    except KeyError:  # the double-struck R, for example, has an older name
        return unicodedata.lookup(name)
