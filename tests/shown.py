"""What a reader sees of HTML."""

from html.parser import HTMLParser


class Shown(HTMLParser):
    """The elements of HTML, their attributes, and the text.

    Args:
        html: a page, or a part of one.
    """

    def __init__(self, html: str) -> None:
        super().__init__()
        self.text = ""
        self.tags: list[str] = []
        self.attributes: list[dict[str, str]] = []
        self.feed(html)
        self.close()

    def handle_starttag(self, tag, attrs):
        self.tags.append(tag)
        self.attributes.append({name: value or "" for name, value in attrs})

    def handle_data(self, data):
        self.text += data

    @property
    def line(self) -> str:
        """The text, with each run of blanks as one."""
        return " ".join(self.text.split())

    def values(self, name: str) -> list[str]:
        """The values of an attribute in all elements."""
        return [each[name] for each in self.attributes if name in each]
