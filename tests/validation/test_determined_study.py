"""The study of undetermined outputs: its perturbation, its figures by hand, and rows of small walls."""

import runpy
from pathlib import Path

import numpy as np
import pytest

RUN = runpy.run_path(str(Path(__file__).resolve().parents[2] / "studies" / "determined" / "run.py"))
SMALL = "1.2 x 0.45 m on a dpc, 2 increments"


def test_spread_and_row_by_hand() -> None:
    assert RUN["spread"]([4.0, 3.0, 5.0], 1.0) == pytest.approx(0.4)
    assert RUN["spread"]([0.0, 2e-6], 1e-5) == pytest.approx(0.2)
    assert np.isnan(RUN["spread"]([1.0, np.nan], 1.0))
    assert [RUN["percent"](s) for s in (0.0, 1e-9, 0.0123, 1.0, np.nan)] == ["0", "< 1e-4 %", "1.2 %", "100 %", "-"]
    widths = dict.fromkeys(RUN["WIDTHS"], 2e-3)
    one = RUN["Outputs"](widths, 1.0, 1.0, 7, 1, 10.0, 1.0)
    other = one._replace(widths=widths | {"crack_width_max": 1e-3}, reaction=0.99, cracked=9, work=20.0, seconds=3.0)
    assert RUN["row"]("wall", "explicit", [one, other]) == [
        *("wall", "explicit", "0", "50 %", "0", "0", "1 %", "7 to 9", "1", "15", "3.00 s")
    ]


def test_stiffnesses_change_by_the_last_digits() -> None:
    (scene,) = RUN["scenes"]([SMALL]).values()
    still, changed = (RUN["changed_stiffness"](scene, number) for number in (0, 1))
    assert set(changed) == {f"{table}.{k}_stiffness" for table in ("joint", "dpc") for k in ("normal", "shear")}
    for name, values in changed.items():
        off = np.abs(values / still[name] - 1.0)
        assert 0.5e-12 < off.max() < 1.1e-12


def test_both_solvers_determine_a_small_wall_on_a_dpc() -> None:
    """Before damping turned with the motion, the explicit opening differed by up to a half."""
    (scene,) = RUN["scenes"]([SMALL]).values()
    for method, allowed in (("explicit", 5e-4), ("quasi_static", 1e-9)):
        found = [RUN["outputs"](scene, method, number) for number in range(3)]
        openings = [f.widths["dpc_opening_max"] for f in found]
        assert RUN["spread"](openings, 1e-5) < allowed
        assert np.mean(openings) == pytest.approx(7.56e-3, rel=2e-3)


@pytest.mark.thorough
def test_the_quick_form(capsys: pytest.CaptureFixture[str]) -> None:
    """The dry wall: single joints move, its crack band and category do not."""
    RUN["main"](["--quick"])
    rows = [line.split(" | ") for line in capsys.readouterr().out.splitlines()[2:]]
    assert [row[1] for row in rows[2:]] == ["explicit", "quasi_static"] * 2
    assert {len(row) for row in rows if len(row) > 1} == {len(RUN["HEAD"])}
    dry = dict(zip(RUN["HEAD"], rows[3], strict=True))
    assert (dry["widest joint"], dry["crack band"], dry["category"]) == ("< 1e-4 %", "< 1e-4 %", "1")
