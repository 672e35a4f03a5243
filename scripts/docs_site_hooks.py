"""Hooks of MkDocs (mkdocs.yml) that make the site from the documents as they are in the repository.

* Anchors are those of GitHub, so that one link works in both places.
* Markdown files outside of docs/ that EXTRA names are pages below repository/. A link to any other file of the
  repository becomes its text, with the path in parentheses.
* Nested lists are indented by four columns, and fences name only a language, as Python-Markdown requires.
* A link to a page or heading that does not exist is a warning, and an error with --strict."""
import glob
import html.parser
import logging
import os
import re
import shutil
import urllib.parse

from mkdocs.structure.files import File

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
EXTRA = ("CONTRIBUTING.md", "CHANGELOG.md", "lcmtypes/PROTOCOL.md", "docker/README.md", "db/README.md", "results/*.md")
PREFIX = "repository/"
JQUERY = "/usr/share/javascript/jquery/jquery.min.js"
LINK = re.compile(r"(!?)\[((?:[^\[\]]|\[[^\]]*\])*)\]\(([^()\s]+)\)")
ITEM = re.compile(r"( *)([*-]|\d+\.)( +)(.*)")
LOG = logging.getLogger("mkdocs.legopt")


def slug(text, separator):
    """Returns the anchor of a heading by GitHub's rule."""
    return re.sub(r"[^\w\- ]", "", text.strip().lower()).replace(" ", separator)


def extra_documents():
    return sorted(os.path.relpath(path, ROOT) for pattern in EXTRA for path in glob.glob(os.path.join(ROOT, pattern)))


def on_config(config):
    config["mdx_configs"].setdefault("toc", {})["slugify"] = slug
    return config


def on_files(files, config):
    for path in extra_documents():
        file = File(PREFIX + path, config["docs_dir"], config["site_dir"], config["use_directory_urls"])
        file.abs_src_path = os.path.join(ROOT, path)
        files.append(file)
    return files


def repository_path(page):
    """Returns the path in the repository of a page's source."""
    return page.removeprefix(PREFIX) if page.startswith(PREFIX) else "docs/" + page


def site_path(path):
    """Returns the source path of a repository file within the site; None if it is not a part of the site."""
    if path.startswith("docs/"):
        return path.removeprefix("docs/")
    return PREFIX + path if path in extra_documents() else None


def rewritten_link(match, page):
    image, text, target = match.groups()
    path, _, anchor = target.partition("#")
    if not path or re.match(r"[a-z]+:", target):
        return match[0]
    source = repository_path(page)
    wanted = os.path.normpath(os.path.join(os.path.dirname(source), path))
    inside = site_path(wanted)
    if inside is None or os.path.isdir(os.path.join(ROOT, wanted)):
        return text if os.path.basename(wanted) in text else f"{text} (`{wanted}`)"
    relative = os.path.relpath(inside, os.path.dirname(page))
    return f"{image}[{text}]({relative}{'#' + anchor if anchor else ''})"


def with_wide_lists(lines):
    """Yields the lines with four columns of indentation for each level of a list."""
    offsets, fenced, blank = [], False, True
    for line in lines:
        if line.startswith("```"):
            fenced, offsets = not fenced, []
            line = line.split()[0]
        if fenced or line.startswith("```") or not line.strip():
            blank = not line.strip()
            yield line
            continue
        indent = len(line) - len(line.lstrip())
        item = ITEM.fullmatch(line)
        if item or blank:
            while offsets and indent < offsets[-1]:
                offsets.pop()
        if item and (offsets or indent < 4):
            if not offsets and not blank:
                yield ""
            yield "    " * len(offsets) + f"{item[2]} {item[4]}"
            offsets.append(len(item[1] + item[2] + item[3]))
        elif offsets:
            yield "    " * len(offsets) + " " * max(0, indent - offsets[-1]) + line.lstrip()
        else:
            yield line
        blank = False


def on_page_markdown(markdown, page, config, files):
    text = "\n".join(with_wide_lists(markdown.split("\n")))
    parts = re.split(r"(^```.*?^```$)", text, flags=re.MULTILINE | re.DOTALL)
    source = page.file.src_uri
    return "".join(part if part.startswith("```") else LINK.sub(lambda match: rewritten_link(match, source), part)
                   for part in parts)


class Anchors(html.parser.HTMLParser):
    """The anchors and the links of a page of the site."""

    def __init__(self, path):
        super().__init__()
        self.anchors, self.links = {""}, []
        with open(path, encoding="utf-8") as file:
            self.feed(file.read())

    def handle_starttag(self, tag, attrs):
        for name, value in attrs:
            if name == "id":
                self.anchors.add(value)
            if value and (name == "href" and tag == "a" or name == "src" and tag == "img"):
                self.links.append(value)


def on_post_build(config):
    site = config["site_dir"]
    asked = os.path.join(site, "js", "jquery-3.6.0.min.js")
    if not os.path.exists(asked) and os.path.exists(JQUERY):  # Debian's theme has it by another name
        shutil.copyfile(JQUERY, asked)
    pages = {os.path.relpath(path, site): Anchors(path) for path in glob.glob(site + "/**/*.html", recursive=True)}
    for name, page in sorted(pages.items()):
        if name in ("404.html", "search.html"):
            continue
        for link in page.links:
            url = urllib.parse.urlsplit(link)
            if url.scheme or url.netloc:
                continue
            path = urllib.parse.unquote(url.path)
            target = os.path.normpath(os.path.join(os.path.dirname(name), path)) if path else name
            if not os.path.exists(os.path.join(site, target)):
                LOG.warning("%s links to %s, which does not exist", name, link)
            elif target in pages and urllib.parse.unquote(url.fragment) not in pages[target].anchors:
                LOG.warning("%s links to %s, which has no such heading", name, link)
