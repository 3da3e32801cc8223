"""README and guide: what they say is current, in short sentences, and every command in them runs."""

import os
import re
import shlex
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from damagepred.cli import main
from damagepred.errors import InputError
from damagepred.guide import TOPICS, page, with_plain_equations
from damagepred.runtime.version import __version__
from damagepred.scene import Scene, Wall
from tests.conftest import ROOT
from tests.guide.pages import ALL, GUIDE, PAGES, REFERENCE, WRITTEN, blocks, sentences

MOST_WORDS = 30
PRIVATE = re.compile(
    r"\b(seed paper|from memory|sandbox|helper|agent|the brief|TODO|FIXME)\b|(?<![\w.)/:])/[a-z]+/", re.IGNORECASE
)
"""Words of those who write the package, and absolute paths; users do not know them."""


def run(command: list[str], folder: Path) -> subprocess.CompletedProcess:
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    environment = os.environ | {"PATH": path, "COLUMNS": "80"}
    return subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, check=False)


def in_a_shell(language: str, text: str) -> None:
    start = ["bash", "-euo", "pipefail", "-c"] if language == "bash" else [sys.executable, "-c"]
    done = run([*start, text], Path.cwd())
    assert done.returncode == 0, f"{text}\n{done.stdout}\n{done.stderr}"


def in_this_process(language: str, text: str) -> None:
    """Run it without starting a process, which takes seconds, if it is no work for a shell."""
    if language == "python":
        exec(compile(text, "snippet", "exec"), {"__name__": "snippet"})
    elif not text.startswith("damagepred ") or set(text) & set(">|;&"):
        in_a_shell(language, text)
    else:
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(sys, "argv", shlex.split(text, comments=True))
            with pytest.raises(SystemExit) as stop:
                main()
            assert not stop.value.code, text


def run_page(name: str, slow: bool) -> int:
    """Run the blocks of a page one after the other; return the number of commands and snippets."""
    count = 0
    for block in blocks(ALL[name]):
        said, text = block.comments, block.quick()
        if {"not run", "main command", "test command"} & set(said) or ("slow" in said and not slow):
            continue
        if "file" in said:
            Path(said["file"][0]).write_text(text, encoding="utf-8")
            continue
        if block.language == "toml":
            Scene.from_dict(tomllib.loads(text))
        if block.language in ("bash", "python"):
            for command in text.strip().splitlines() if block.language == "bash" else [text]:
                in_this_process(block.language, command)
                count += 1
    return count


RUN = [name for name, path in ALL.items() if any(block.language for block in blocks(path))]
"""Pages with commands or snippets."""


@pytest.mark.parametrize("name", RUN)
def test_commands_and_snippets_of_a_page_run(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert run_page(name, slow=False) > 0


@pytest.mark.slow
@pytest.mark.parametrize("name", [name for name in RUN if any("slow" in b.comments for b in blocks(ALL[name]))])
def test_slow_blocks_of_a_page_run(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert run_page(name, slow=True) > 0


def test_the_question_of_a_consultant_takes_ten_commands_and_compares_three_alternatives() -> None:
    text = [block.text for block in blocks(ALL["my-house-on-h1-clay"]) if block.language == "bash"]
    commands = [line for part in text for line in part.strip().splitlines()]
    assert len(commands) <= 10
    (compare,) = (line for line in commands if line.startswith("damagepred compare "))
    assert len(re.findall(r"\w+\.dp", compare)) == 3
    assert "--category 2 --at H1" in compare


@pytest.mark.parametrize("topic", PAGES)
def test_generated_pages_are_what_the_code_says(topic: str) -> None:
    assert page(topic) == PAGES[topic](), "run: python .ci/reference_pages.py"


def test_every_key_of_a_table_is_described_with_unit_default_and_range() -> None:
    text = page("keys")
    for name in REFERENCE["described_fields"](Wall)[1]:
        assert f"| `{name}` |" in text
    assert "| `length` | m | 6 | above 0, at most 1000 | Length of the wall. |" in text
    assert "| `bond` | `running` or `stack` or `header` or `english` or `flemish` | `running` |" in text
    assert "| `x` | m | required | at least 0 |" in text
    assert "| `normal_stiffness` | Pa/m | 8.2e+10 | at least 0.001 | k_n. |" in text


@pytest.mark.parametrize("path", ALL.values(), ids=lambda p: p.stem)
def test_sentences_are_short_and_words_are_not_private(path: Path) -> None:
    text = path.read_text(encoding="utf-8")
    long = [s for s in sentences(text) if len(s.split()) > MOST_WORDS]
    assert not long, "\n".join(f"{len(s.split())} words: {s}" for s in long)
    assert not PRIVATE.findall(text)


@pytest.mark.parametrize("path", [*WRITTEN.values(), ROOT / "CONTRIBUTING.md"], ids=lambda p: p.stem)
def test_links_lead_to_files(path: Path) -> None:
    for link in re.findall(r"\]\(([^)#]+)\)", path.read_text(encoding="utf-8")):
        assert link.startswith("https://") or (path.parent / link).exists(), link


@pytest.mark.parametrize("path", ALL.values(), ids=lambda p: p.stem)
def test_equations_are_whole_and_legible_in_a_terminal(path: Path) -> None:
    text = re.sub(r"^```.*?^```$", "", path.read_text(encoding="utf-8"), flags=re.MULTILINE | re.DOTALL)
    assert all(line.count("$") % 2 == 0 for line in text.splitlines()), "an equation in a line ends in that line"
    for equation in re.findall(r"^\$\$\n.*?\n\$\$$|\$[^$\n]+\$", text, re.MULTILINE | re.DOTALL):
        assert not re.search(r"[$\\{}&]", with_plain_equations(equation)), equation


@pytest.mark.parametrize(
    ("latex", "plain"),
    [
        (r"$\frac{1}{k} = \frac{1}{k_n} + \frac{(1 - \nu^2) h}{E}$", "`1/k = 1/k_n + ((1 - ν^2) h)/E`"),
        (r"$\lvert \tau \rvert \le \sqrt{(f_c^2 - \sigma^2) / C_{ss}}$", "`| τ | ≤ √((f_c^2 - σ^2) / C_ss)`"),
        (
            "$$\n\\begin{aligned}\na &= b_{ext} \\\\\nc &\\le e^{-a \\xi}\n\\end{aligned}\n$$",
            "```\na = b_ext\nc ≤ e^(-a ξ)\n```",
        ),
    ],
)
def test_an_equation_in_plain_characters(latex: str, plain: str) -> None:
    assert with_plain_equations(latex) == plain


def test_functions_that_compute_the_equations_exist() -> None:
    table = page("theory").partition("## Where each equation is computed")[2]
    rows = re.findall(r"^\| (\d+ .*) \| (`.*`) \| (`.*`) \|$", table, re.MULTILINE)
    assert len(rows) >= 40
    for equation, modules, functions in rows:
        text = "".join((ROOT / "damagepred" / m).read_text(encoding="utf-8") for m in re.findall("`(.*?)`", modules))
        for name in re.findall(r"`(?:\w+\.)?(\w+)`", functions):
            assert re.search(rf"\b(def|class) {name}\b|^{name}\b", text, re.MULTILINE), (
                f"{equation}: {name} is not in {modules}"
            )


def test_studies_and_data_that_pages_name_exist() -> None:
    for path in WRITTEN.values():
        for named in re.findall(r"`((?:studies|data|damagepred|tests)/[\w./]+)`", path.read_text(encoding="utf-8")):
            assert (ROOT / named).exists() or named.endswith("/results"), f"{path.name}: {named}"


def test_readme_is_one_screen_and_citation_is_of_this_version() -> None:
    assert len((ROOT / "README.md").read_text(encoding="utf-8").splitlines()) <= 120
    assert f"version: {__version__}\n" in (ROOT / "CITATION.cff").read_text(encoding="utf-8")


def test_every_page_is_a_topic() -> None:
    assert {p.stem for p in GUIDE.glob("*.md")} - {"words"} == set(TOPICS)


def test_a_wrong_topic_is_told_the_nearest() -> None:
    with pytest.raises(InputError, match="Did you mean 'theory'"):
        page("theorie")


def test_the_command_prints_a_page_as_it_is_where_no_terminal_is(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "damagepred", "guide"]
    listed = run(command, tmp_path)
    assert all(topic in listed.stdout for topic in TOPICS)
    assert run([*command, "theory"], tmp_path).stdout == page("theory")
    wrong = run([*command, "glosary"], tmp_path)
    assert wrong.returncode == 2
    assert "Did you mean 'glossary'?" in wrong.stderr
