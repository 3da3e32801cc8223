"""Templates of ``damagepred new``: what they sample, and the files beside them."""

from pathlib import Path

import numpy as np
import pytest

from damagepred.campaign.settings import StudySettings
from damagepred.campaign.template import write_template
from damagepred.errors import InputError
from damagepred.uq.observations import Observations


def test_the_soil_log_has_its_surface_movement_by_hand(tmp_path: Path) -> None:
    write_template(tmp_path / "log.toml", "soil-log")
    scene = StudySettings.from_toml(tmp_path / "log.toml").scene
    # alpha is 1 in the cracked upper half of H_s = 2.3 m and 2 - z / 5 below; suction falls from 1.2 pF to 0 at H_s
    z = (0.5 + np.arange(23000)) * 1e-4
    strain = np.where(z < 0.4, 0.01, np.where(z < 1.6, 0.04, 0.03))
    rise = strain * np.where(z < 1.15, 1.0, 2.0 - z / 5.0) * 1.2 * (1.0 - z / 2.3) * 1e-4
    assert scene.mound.surface_movement == pytest.approx(rise.sum(), rel=1e-4)
    assert scene.loads.roof == pytest.approx(24e3)


def test_a_survey_comes_with_its_observations(tmp_path: Path) -> None:
    files = write_template(tmp_path / "house.toml", "survey")
    assert [file.name for file in files] == ["house.toml", "house_observations.toml"]
    assert Observations.from_toml(files[1]) is not None
    (tmp_path / "house.toml").unlink()
    with pytest.raises(InputError, match=r"house_observations\.toml: exists and was not changed"):
        write_template(tmp_path / "house.toml", "survey")
