"""Pictures of the guide: its sketches, and its gallery by the files and commands that the page shows.

Run: python studies/gallery/run.py     (a minute; writes damagepred/guide/gallery/*.png and sketches/*.png)
     python studies/gallery/run.py --sketches     (sketches alone, in seconds)
"""

from __future__ import annotations

import re
import subprocess
import sys
import tempfile
from pathlib import Path

from PIL import Image
from sketches import write

GUIDE = Path(__file__).resolve().parents[2] / "damagepred" / "guide"
WIDTH = 1000
"""Size of a picture on the page (pixels)."""
_BLOCK = re.compile(
    r"(?:<!-- file: (?P<file>\S+) -->\n(?:<!--[^\n]*-->\n)*)?```(?P<kind>toml|bash)\n(?P<text>.*?)```", re.DOTALL
)
_PICTURE = re.compile(r"!\[.*?\]\(gallery/(?P<name>\w+\.png)\)")


def main() -> None:
    """Draw the sketches; then run the page from top to bottom and keep the pictures that it shows."""
    write(GUIDE / "sketches")
    if "--sketches" in sys.argv:
        return
    page = (GUIDE / "gallery.md").read_text(encoding="utf-8")
    with tempfile.TemporaryDirectory() as name:
        place = Path(name)
        for found in sorted([*_BLOCK.finditer(page), *_PICTURE.finditer(page)], key=lambda match: match.start()):
            if found.re is _PICTURE:
                drawn = max(place.rglob(found["name"]), key=lambda file: file.stat().st_mtime)
                with Image.open(drawn) as picture:
                    height = round(WIDTH * picture.height / picture.width)
                    small = picture.convert("RGB").resize((WIDTH, height), Image.Resampling.LANCZOS)
                    small.quantize(256, Image.Quantize.MAXCOVERAGE).save(
                        GUIDE / "gallery" / found["name"], optimize=True
                    )
                print(found["name"], flush=True)
            elif found["kind"] == "toml":
                (place / found["file"]).write_text(found["text"], encoding="utf-8")
            else:
                for line in found["text"].replace("\\\n", " ").splitlines():
                    command = line.partition("#")[0].split()
                    if command:
                        subprocess.run([sys.executable, "-m", *command], cwd=place, check=True, capture_output=True)


if __name__ == "__main__":
    main()
