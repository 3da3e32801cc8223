"""A study that stops early has run the first walls of one that did not."""

import json
import tomllib
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

from damagepred.archive.folder import StudyFolder
from damagepred.campaign.settings import StudySettings
from damagepred.campaign.stopping import run_until
from damagepred.cli.sentences import ending_lines
from damagepred.errors import InputError, StudyError
from damagepred.study import Study, open_study
from tests.conftest import SMALL_STUDY

TINY = SMALL_STUDY.replace("length = 1.44", "length = 0.96").replace("increments = 6", "increments = 3")


def settings(extra: str = "", **sampling: object) -> StudySettings:
    tables = tomllib.loads(TINY + extra)
    tables["study"] |= sampling
    return StudySettings.from_dict(tables)


def test_a_study_stops_when_the_interval_is_small_enough(tmp_path: Path) -> None:
    rule = {"category": 1, "at": "6 mm", "half_width": 0.32, "first": 8}
    study = Study(settings(samples=64, replicates=4, stop_when=rule))
    with ThreadPoolExecutor(2) as executor:
        ending = run_until(study, tmp_path / "s.dp", executor=executor)
        assert ending.reason == "enough"
        counts = [look.samples for look in ending.looks]
        assert counts == [8, 16, 32, 64][: len(counts)]
        assert counts[-1] < 64
        # the same again, and a study without a stopping rule
        again = run_until(study, tmp_path / "s.dp", executor=executor)
        Study(settings(samples=counts[-1], replicates=4)).run(tmp_path / "plain.dp", executor=executor)
    assert again.looks == ending.looks
    one, other = open_study(tmp_path / "s.dp"), open_study(tmp_path / "plain.dp")
    np.testing.assert_array_equal(one["crack_width_max"], other["crack_width_max"])
    kept = json.loads((tmp_path / "s.dp" / "stopping.json").read_text())
    assert kept["reason"] == "enough"
    assert kept["looks"][-1]["samples"] == counts[-1]
    assert "narrow enough" in " ".join(ending_lines(ending, study.settings.study.stop_when))


def test_a_latin_hypercube_cannot_be_stopped(tmp_path: Path) -> None:
    rule = {"category": 1, "at": "6 mm", "half_width": 0.3}
    with pytest.raises(InputError, match="Latin hypercube"):
        run_until(Study(settings(sampler="lhs", stop_when=rule)), tmp_path / "s.dp")


def test_weights_are_kept_with_the_samples(tmp_path: Path) -> None:
    study = Study(settings(samples=8, importance={"joint.friction": {"shift": -1.5}}, nominal_share=0.2))
    with ThreadPoolExecutor(2) as executor:
        study.run(tmp_path / "s.dp", samples=4, executor=executor)
        study.run(tmp_path / "s.dp", executor=executor)
    ds = open_study(tmp_path / "s.dp")
    assert StudyFolder(tmp_path / "s.dp").manifest()["samples"] == 8
    np.testing.assert_array_equal(ds["weight"], study.design.weights(8))
    assert ds["weight"].max() <= 5
    assert (ds["joint.friction"] == study.design.wall_values(8)["joint.friction"]).all()


def test_a_study_of_the_users_own_samples(tmp_path: Path) -> None:
    text = TINY.replace('"joint.friction" = { distribution = "lognormal", mean = 0.75, cov = 0.15 }\n', "")
    start, end = text.index('[variables."movement'), text.index("[correlation]")
    text = (text[:start] + text[end:]).replace("seed = 7", 'seed = 7\nsampler = "table"\ntable = "samples.csv"')
    file, table = tmp_path / "house.toml", tmp_path / "samples.csv"
    file.write_text(text)
    rows = ["joint.friction,movement.central_deflection [mm]", "0.7,6", "0.8,7", "0.75,8", "0.6,9"]
    table.write_text("\n".join(rows[:4]))
    with ThreadPoolExecutor(2) as executor:
        Study.from_toml(file).run(tmp_path / "s.dp", samples=3, executor=executor)
        with pytest.raises(InputError, match=r"samples = 4: the table has 3"):
            Study.from_toml(file).run(tmp_path / "s.dp", samples=4, executor=executor)
        table.write_text("\n".join(rows))
        Study.from_toml(file).run(tmp_path / "s.dp", samples=4, executor=executor)
        ds = open_study(tmp_path / "s.dp")
        np.testing.assert_allclose(ds["movement.central_deflection"], [6e-3, 7e-3, 8e-3, 9e-3])
        np.testing.assert_allclose(ds["central_deflection"].values[:, -1], [6e-3, 7e-3, 8e-3, 9e-3])
        table.write_text("\n".join(rows).replace("0.8", "0.81"))
        with pytest.raises(StudyError, match=r"joint.friction of sample 1 \(was 0.8, is 0.81\)"):
            Study.from_toml(file).run(tmp_path / "s.dp", samples=4, executor=executor)
    from damagepred.campaign.replay import replay

    table.unlink()
    assert "bit for bit" in replay(tmp_path / "s.dp", 2)[1]
