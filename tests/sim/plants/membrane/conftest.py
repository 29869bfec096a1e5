import pytest

from sim.membrane.material import NEO_HOOKEAN
from sim.membrane.plant import MembranePlant


@pytest.fixture(scope="session")
def cache(tmp_path_factory):
    """An empty cache, so that tables come from this code and not from an earlier one."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_CACHE_HOME", str(tmp_path_factory.mktemp("cache")))
        yield


@pytest.fixture(scope="session")
def one_sided(cache):
    return MembranePlant()


@pytest.fixture(scope="session")
def two_sided(cache):
    return MembranePlant(NEO_HOOKEAN, sides=2)


@pytest.fixture(scope="session")
def with_limit_point(cache):
    return MembranePlant(NEO_HOOKEAN, sides=1)


@pytest.fixture(params=["one_sided", "two_sided", "with_limit_point"])
def plant(request):
    return request.getfixturevalue(request.param)
