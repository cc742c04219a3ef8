"""Formulas as MathML, which browsers draw by themselves: no script, no network."""

import html
import re
import unicodedata
from typing import Any

from latex2mathml.converter import convert
from mkdocs.exceptions import PluginError

FORMULA = re.compile(r'<(span|div) class="arithmatex">\\[(\[](.*?)\\[)\]]</\1>', re.DOTALL)
"""What arithmatex makes of TeX between dollars."""

STYLES = {"bold": "BOLD", "bold-italic": "BOLD ITALIC", "double-struck": "DOUBLE-STRUCK"}
STYLED = re.compile(rf'<mi mathvariant="({"|".join(STYLES)})">(&#x\w+;|\w)</mi>')
UNKNOWN = re.compile(r'\\|mathvariant="(?!normal)')
"""What latex2mathml leaves of TeX, and styles of letters, of which browsers know but normal."""

CODE = re.compile(r"<(pre|code)\b.*?</\1>", re.DOTALL)


def on_page_content(content: str, page: Any, **_: Any) -> str:
    """Replace the formulas of a page; one that cannot be is an error."""
    place = page.file.src_uri
    if not place.endswith(".md"):
        return content
    content = FORMULA.sub(lambda found: mathml(found, place), content)
    if left := re.search(r".{0,40}\$.{0,40}", CODE.sub("", content)):
        raise PluginError(f"{place}: no formula begins or ends at the dollar in {left[0]!r}")
    return content


def mathml(found: re.Match[str], place: str) -> str:
    """One formula."""
    tex = html.unescape(found[2])
    try:
        formula = convert(tex, display="block" if found[1] == "div" else "inline")
    except Exception as failure:  # latex2mathml has a class of its own for each mistake
        raise PluginError(f"{place}: {tex!r}: {failure!r}") from failure
    formula = STYLED.sub(lambda letter: f"<mi>{styled(*letter.groups())}</mi>", formula)
    if UNKNOWN.search(formula):
        raise PluginError(f"{place}: {tex!r}: MathML cannot show all of it")
    return formula


def styled(style: str, letter: str) -> str:
    """A Latin or Greek letter in a style, as a character of its own."""
    _, case, _, letter = unicodedata.name(html.unescape(letter)).split()
    name = f"{STYLES[style]} {case} {letter}"
    try:
        return unicodedata.lookup(f"MATHEMATICAL {name}")
    except KeyError:  # such as the double-struck R, which is older
        return unicodedata.lookup(name)
