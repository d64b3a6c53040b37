"""Lays out the repository's Markdown files and pictures for the site: pages.py REPOSITORY FOLDER.

A link to another page or picture stays; one to anything else of the repository leads to its address.
"""

import os
import posixpath
import re
import subprocess
import sys
from pathlib import Path

SHOWN = ["*.md", "*.png", "*.svg", "*.gif", "tests/site/site.css"]
FENCE = re.compile(r"^( *)(```+)(\w*)(?:[ ,][^\n]*)?\n(.*?^\1\2) *$", re.MULTILINE | re.DOTALL)
LINK = re.compile(r"(?<=\]\()([^)\s]+)(?=\))")


def led(page, text, shown, root, address):
    def target(match):
        link = match[0]
        if re.match(r"[a-z]+:|#", link):
            return link
        place, hash, anchor = link.partition("#")
        path = posixpath.normpath(posixpath.join(posixpath.dirname(page), place))
        if path in shown:
            return link
        if f"{path}/README.md" in shown:
            return f"{place.rstrip('/')}/README.md{hash}{anchor}"
        if not (root / path).exists():
            sys.exit(f"error: {page}: nothing is at {link}\nhint: mend the link")
        return f"{address}/blob/main/{path}{hash}{anchor}"

    out, end = [], 0
    for fence in FENCE.finditer(text):
        # The word after the language is for the tests.
        block = "{}{}{}\n{}".format(*fence.groups())
        out += [LINK.sub(target, text[end : fence.start()]), block]
        end = fence.end()
    return "".join(out) + LINK.sub(target, text[end:])


def main(root, folder):
    listed = subprocess.run(["git", "ls-files", "-coz", "--exclude-standard", "--", *SHOWN], cwd=root, capture_output=True, check=True)
    shown = {path for path in listed.stdout.decode().split("\0") if path}
    address = os.environ.get("GRIDEYE_REPOSITORY", "https://example.com/grideye-hil")
    for path in shown:
        out = folder / path
        out.parent.mkdir(parents=True, exist_ok=True)
        if path.endswith(".md"):
            out.write_text(led(path, (root / path).read_text(), shown, root, address))
        else:
            out.write_bytes((root / path).read_bytes())


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
