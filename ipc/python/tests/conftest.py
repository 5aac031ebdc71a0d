import pytest
from stage import Stage


@pytest.fixture
def stage(tmp_path):
    """An instance of the test's own, of which nothing may be left."""
    stage = Stage(tmp_path)
    yield stage
    assert stage.close() == []
