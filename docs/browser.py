"""Pages of a built site in a browser: `python -m docs.browser FOLDER`; exit code 1 if one fails.

Chromium opens the files themselves, without a server or a network: a page must have its heading and
no error of a script, and a search must find something. Where there is no browser, that is said.
"""

from __future__ import annotations

import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

NAMES = ("chromium", "chromium-browser", "google-chrome")
OPTIONS = ("--headless", "--no-sandbox", "--disable-gpu", "--enable-logging=stderr",
           "--virtual-time-budget=8000", "--dump-dom")  # fmt: skip
SOUGHT = "irradiance"  # a word that many pages have


def browser() -> str | None:
    """Path of a browser; None if there is none."""
    return next(filter(None, map(shutil.which, NAMES)), None)


def opened(address: str) -> tuple[str, list[str]]:
    """A page after its scripts ran, and the errors that these told of."""
    found = browser()
    assert found is not None
    with tempfile.TemporaryDirectory() as profile:
        command = [found, *OPTIONS, f"--user-data-dir={profile}", address]
        done = subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)
    said = re.findall(r':CONSOLE[:(]\d+\)?\] "(.*)", source', done.stderr)
    wrong = [words for words in said if re.search(r"Uncaught|ERR_|blocked|Error", words)]
    return done.stdout, wrong


def photographed(page: str, width: int, height: int) -> bytes:
    """A page of HTML as a PNG picture."""
    found = browser()
    assert found is not None, "a page is photographed where there is a browser"
    with tempfile.TemporaryDirectory() as folder:
        file, picture = pathlib.Path(folder, "page.html"), pathlib.Path(folder, "page.png")
        file.write_text(page, encoding="utf-8")
        options = ("--headless", "--no-sandbox", "--disable-gpu", "--hide-scrollbars",
                   f"--user-data-dir={folder}/profile", f"--window-size={width},{height}",
                   f"--screenshot={picture}", "--virtual-time-budget=8000")  # fmt: skip
        subprocess.run([found, *options, file.as_uri()], check=True, capture_output=True)
        return picture.read_bytes()


def chosen(folder: pathlib.Path) -> list[pathlib.Path]:
    """Pages written by hand, and of those that the code writes the first of each folder."""
    pages = sorted(p for p in folder.rglob("*.html") if p.name not in ("search.html", "404.html"))
    first = {page.parent: page for page in reversed(pages)}
    return [p for p in pages if p.parent == folder or first[p.parent] == p]


def wrong(folder: pathlib.Path) -> list[str]:
    """Sentences about the pages that do not open as they should."""
    found = []
    for page in chosen(folder):
        shown, errors = opened(page.resolve().as_uri())
        name = page.relative_to(folder).as_posix()
        found += [f"{name}: {words}" for words in errors]
        if "</h1>" not in shown:
            found.append(f"{name}: no heading is shown")
    shown, errors = opened(f"{(folder / 'search.html').resolve().as_uri()}?q={SOUGHT}")
    found += [f"search: {words}" for words in errors]
    if not re.search(r'<ul[^>]*class="search"[^>]*>\s*<li', shown):
        found.append(f"search: nothing is found for {SOUGHT}")
    return found


def main(folder: str) -> int:
    """Print what is wrong, or that there is no browser to see it."""
    if browser() is None:
        print("There is no browser here: pages are not opened.")
        return 0
    pages = pathlib.Path(folder)
    found = wrong(pages)
    print(*(found or [f"{len(chosen(pages))} pages and a search open without an error."]), sep="\n")
    return int(bool(found))


if __name__ == "__main__":
    raise SystemExit(main(sys.argv[1]))
