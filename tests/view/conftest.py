import pytest
from tests.made_up_runs import made_up_run


@pytest.fixture(scope="session")
def run():
    return made_up_run()
