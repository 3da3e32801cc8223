"""Pages of the site: repository files at their own paths, so that links hold, and reference pages from the code.

mkdocs runs this module as a hook; see ``mkdocs.yml``.
"""

from __future__ import annotations

import re
import subprocess
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
PAGES = (
    "README.md",
    "CHANGELOG.md",
    "CONTRIBUTING.md",
    "damagepred/guide/",
    "studies/",
    "tests/verification/README.md",
)
LINK = re.compile(r"!?\[[^\]]*\]\(([^)#\s]+)[^)]*\)")
ELSEWHERE = re.compile(
    r"<(?:script|link|img|iframe|source|video|object)\b[^>]*?\b(?:src|href|data)=[\"']?(?:https?:)?//[^>]*>"
)
"""Element of a page that a browser loads from a network."""
REFERENCE = {
    "scene": ("Scene classes", ("scene",)),
    "assembly": ("Assembly", ("assembly",)),
    "damage": ("Damage", ("damage",)),
    "plotting": ("Plotting", ("plotting",)),
    "exports": ("Exports and report", ("exports", "report")),
}
"""Reference pages: title, and the public modules whose names they list."""


def on_config(config: Any) -> Any:
    """Fill the navigation with notebooks and studies."""
    for part in config["nav"]:
        if "Notebooks" in part:
            part["Notebooks"] = ["studies/notebooks/README.md", *_tracked("studies/notebooks/*.ipynb")]
        if "Studies" in part:
            pages = [p for p in _tracked("studies/**/*.md") if "notebooks" not in p]
            part["Studies"] = [{_title(page): page} for page in pages]
    return config


def on_files(files: Any, config: Any) -> Any:
    """Put the repository's pages and the files they link to in place of those of the guide's folder."""
    from mkdocs.exceptions import PluginError
    from mkdocs.structure.files import File

    for file in [f for f in files if f.abs_src_path and Path(f.abs_src_path).is_relative_to(ROOT / "damagepred")]:
        files.remove(file)
    pages = [p for p in _tracked() if p.startswith(PAGES) and p.endswith((".md", ".ipynb"))]
    linked = {target for page in pages if page.endswith(".md") for target in _targets(page)}
    linked |= {target for page in linked if page.endswith(".md") for target in _targets(page)}
    for path in sorted({*pages, *linked}):
        files.append(File(path, str(ROOT), config["site_dir"], config["use_directory_urls"]))
    for name, text in _reference_pages().items():
        files.append(File.generated(config, f"reference/{name}.md", content=text))
    mathjax = Path(import_module("jupyter_server_mathjax").__file__).parent / "static"
    for script in config["extra_javascript"]:
        name = str(script).partition("?config=")[2]
        if name and not (mathjax / "config" / f"{name}.js").is_file():
            raise PluginError(f"mkdocs.yml: MathJax has no configuration {name}; without it no equation is set.")
    for path in mathjax.rglob("*"):
        if path.is_file():
            target = str(path.relative_to(mathjax))
            files.append(File.generated(config, f"mathjax/{target}", abs_src_path=str(path)))
    files.append(File.generated(config, "mathjax/fonts.js", content=MATHJAX))
    for script in config["extra"]["polyfills"]:
        files.append(File.generated(config, script, abs_src_path=str(ROOT / ".ci" / Path(script).name)))
    return files


on_files.mkdocs_priority = 100  # type: ignore[attr-defined]  # before notebooks are converted


def on_page_markdown(markdown: str, page: Any, config: Any, files: Any) -> str:
    """Drop the marks for tests."""
    return re.sub(r"(?m)^<!-- .*? -->\n", "", markdown)


def on_post_page(output: str, page: Any, config: Any) -> str:
    """Drop the script that a converted notebook loads from elsewhere; no notebook has a diagram for it."""
    return re.sub(
        r"<script type=\"module\">(?:(?!</script>).)*?https://(?:(?!</script>).)*</script>", "", output, flags=re.S
    )


def on_post_build(config: Any) -> None:
    """Check that no page loads anything from elsewhere."""
    from mkdocs.exceptions import PluginError

    for page in sorted(Path(config["site_dir"]).rglob("*.html")):
        if found := ELSEWHERE.search(page.read_text(encoding="utf-8")):
            raise PluginError(f"{page}: is loaded from elsewhere: {found[0]}; the site must open without a network.")


def _tracked(*patterns: str) -> list[str]:
    """Paths of the repository's files, by Git."""
    found = subprocess.run(["git", "ls-files", *patterns], cwd=ROOT, check=True, capture_output=True, text=True)
    return found.stdout.splitlines()


def _title(page: str) -> str:
    """First heading of a page."""
    return re.search(r"(?m)^# (.*)$", (ROOT / page).read_text(encoding="utf-8")).group(1)  # type: ignore[union-attr]


def _targets(page: str) -> set[str]:
    """Files of the repository that a page links to."""
    folder = (ROOT / page).parent
    targets = {(folder / link).resolve() for link in LINK.findall((ROOT / page).read_text(encoding="utf-8"))}
    return {str(t.relative_to(ROOT)) for t in targets if t.is_file() and t.is_relative_to(ROOT)}


def _reference_pages() -> dict[str, str]:
    """Text of the reference pages, by name."""
    import damagepred

    names = [n for n in damagepred.__all__ if not isinstance(getattr(damagepred, n), (ModuleType, str))]
    listed = {
        page: sorted(
            ((home, n) for home in homes for n in import_module(f"damagepred.{home}").__all__),
            key=lambda pair: names.index(pair[1]) if pair[1] in names else len(names),
        )
        for page, (_, homes) in REFERENCE.items()
    }
    elsewhere = {n for pairs in listed.values() for _, n in pairs}
    here = [(_home(n), n) for n in names if n not in elsewhere]
    pages = {"python": PYTHON + _entries(here)}
    pages |= {page: f"# {REFERENCE[page][0]}\n\n{_entries(pairs)}" for page, pairs in listed.items()}
    return pages | {"commands": _commands(), "citing": _citing()}


def _entries(names: list[tuple[str, str]]) -> str:
    """Places of docstrings on a page, by module and name."""
    return "".join(f"::: damagepred.{home}.{name}\n\n" for home, name in names)


def _home(name: str) -> str:
    import damagepred

    return damagepred._HOMES[name]


PYTHON = """# Python

A [scene](scene.md) describes one wall, and `solve` computes its path. A `Study` samples walls, and `fit_fragility` fits
curves to its results. The names stand in this order: one wall, studies, curves and probabilities, further analyses,
errors. They are names of `damagepred` itself, as in `damagepred.solve`.

"""


MATHJAX = 'window.MathJax = {"HTML-CSS": {availableFonts: [], preferredFont: null, webFont: "STIX-Web"}};\n'
"""Equations in the only font that comes with MathJax here: nothing is loaded from elsewhere."""

COMMANDS = {
    "check": "damagepred.scene.Scene",
    "solve": "damagepred.solve",
    "study": "damagepred.Study",
    "status": "damagepred.open_study",
    "rare": "damagepred.subset_simulation",
    "estimate": "damagepred.exceedance",
    "compare": "damagepred.compare",
    "infer": "damagepred.infer",
    "design": "damagepred.search_design",
    "portfolio": "damagepred.assess_portfolio",
    "fragility": "damagepred.fit_fragility",
    "export": "damagepred.exports",
    "sensitivity": "damagepred.study_sensitivity",
    "plot": "damagepred.plotting",
    "cracks": "damagepred.cracks",
    "judge": "damagepred.judge_again",
    "scales": "damagepred.compare_scales",
    "report": "damagepred.report.write_report",
}
"""Python name that does the work of a command."""


MODULE_PAGES = ("damagepred.exports", "damagepred.plotting")


def _commands() -> str:
    """Page that joins commands and Python names."""
    from typer.main import get_command

    from damagepred.cli import app

    rows = []
    for name, command in sorted(get_command(app).commands.items()):  # type: ignore[attr-defined]
        text = (command.help or "").strip().split("\n\n")[0].replace("\n", " ")
        python = COMMANDS.get(name)
        link = f"[`{python}`]({python.split('.')[1]}.md)" if python in MODULE_PAGES else f"[`{python}`][{python}]"
        rows.append(f"| `damagepred {name}` | {text} | {link if python else ''} |")
    return "\n".join(
        ["# Commands and Python names", "", "| command | what it does | in Python |", "|---|---|---|", *rows]
    )


def _citing() -> str:
    """Page of the citation file."""
    return f"# How to cite\n\n```yaml\n{(ROOT / 'CITATION.cff').read_text(encoding='utf-8')}```\n"
