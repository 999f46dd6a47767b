"""Links of a built site that lead nowhere: `python -m docs.links FOLDER`; exit code 1 if any do.

Only what lies in the folder is looked at; addresses of other sites are left alone.
"""

from __future__ import annotations

import html.parser
import pathlib
import sys
import urllib.parse


class _Page(html.parser.HTMLParser):
    """What a page links to, and what in it can be linked to."""

    def __init__(self):
        super().__init__()
        self.targets: list[str] = []
        self.ids: set[str] = set()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Note what an element names and where it leads."""
        for name, value in attrs:
            if name in ("href", "src") and value:
                self.targets.append(value)
            elif name == "id" and value:
                self.ids.add(value)


def broken(folder: pathlib.Path) -> list[str]:
    """Links that lead nowhere, each as "page: target"."""
    pages = {path.resolve(): _read(path) for path in sorted(folder.rglob("*.html"))}
    return [
        f"{path.relative_to(folder.resolve())}: {target}"
        for path, page in pages.items()
        for target in page.targets
        if not _leads_somewhere(path, target, pages)
    ]


def _read(path: pathlib.Path) -> _Page:
    page = _Page()
    page.feed(path.read_text(encoding="utf-8"))
    return page


def _leads_somewhere(path: pathlib.Path, target: str, pages: dict[pathlib.Path, _Page]) -> bool:
    parts = urllib.parse.urlsplit(target)
    if parts.scheme or parts.netloc:
        return True
    there = (path.parent / urllib.parse.unquote(parts.path)).resolve() if parts.path else path
    fragment = urllib.parse.unquote(parts.fragment)
    if there not in pages:
        return there.is_file() and not fragment
    return not fragment or fragment in pages[there].ids


def main(folder: str) -> int:
    """Print what is broken."""
    site = pathlib.Path(folder)
    found = broken(site)
    print(*found, f"{len(list(site.rglob('*.html')))} pages, {len(found)} broken links", sep="\n")
    return int(bool(found))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))
