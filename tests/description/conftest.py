from pathlib import Path

import pytest

from nectosome.description import RobotDescription, load_robot

FLAGELLUM = Path(__file__).parent / "flagellum.yaml"


@pytest.fixture(scope="session")
def flagellum_file() -> Path:
    return FLAGELLUM


@pytest.fixture(scope="session")
def flagellum() -> RobotDescription:
    return load_robot(FLAGELLUM)
