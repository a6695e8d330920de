"""A parser that collects what a report's page holds."""

from html.parser import HTMLParser

LOADS = {"src", "href", "xlink:href", "data", "action", "poster", "srcset", "background", "formaction"}
"""Attributes that load something or lead somewhere."""

EMPTY = {"meta", "br", "link", "img", "input", "hr"}


class Parsed(HTMLParser):
    """The tags, names, links, tables and figures of a page; a fault if tags are not nested."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.tags: list[str] = []
        self.ids: list[str] = []
        self.links: list[str] = []
        self.images: list[str] = []
        self.text: dict[str, list[str]] = {}
        self.attributes: list[str] = []
        self._open: list[str] = []
        self.feed(text)
        self.close()
        assert self._open == []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        given = dict(attrs)
        self.attributes += given
        if "id" in given:
            self.ids.append(given["id"] or "")
        self.links += [value or "" for name, value in attrs if name in LOADS]
        if tag == "img":
            self.images.append(given.get("alt") or "")
        if tag not in EMPTY:
            self._open.append(tag)
            self.text.setdefault(tag, []).append("")

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.handle_starttag(tag, attrs)
        if tag not in EMPTY:
            self.handle_endtag(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self._open.pop() == tag

    def handle_data(self, data: str) -> None:
        for tag in set(self._open):
            self.text[tag][-1] += data


def check_page(text: str) -> Parsed:
    """What holds for every report: nothing is loaded, no scripts, unique names, words for all figures and tables."""
    page = Parsed(text)
    assert len(page.ids) == len(set(page.ids))
    assert not {"script", "link", "iframe", "object", "embed", "base", "form"} & set(page.tags)
    assert all(link.startswith("data:image/svg+xml;base64,") for link in page.links), page.links
    assert not [name for name in page.attributes if name.startswith("on")]
    assert "@import" not in text
    assert "url(" not in text
    assert page.tags.count("figure") == page.tags.count("figcaption") == page.tags.count("img")
    assert all(words.strip() for words in page.images)
    assert all(words.strip() for tag in ("title", "figcaption", "caption", "h1") for words in page.text.get(tag, []))
    assert page.tags.count("caption") == page.tags.count("table")
    assert page.text["title"][0].strip() == page.text["h1"][0].strip()
    return page
