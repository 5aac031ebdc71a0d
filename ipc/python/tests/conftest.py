import pytest
from stage import Stage


@pytest.fixture
def stage(tmp_path):
    """Provides an instance for one test. Nothing of it may remain after the test."""
    stage = Stage(tmp_path)
    yield stage
    assert stage.close() == []
