import pytest

from pneuforce.sim.plants.membrane.material import NEO_HOOKEAN
from pneuforce.sim.plants.membrane.plant import MembranePlant


@pytest.fixture(scope="session")
def cache(tmp_path_factory):
    """Use an empty cache, so that the tables are computed by this version of the code."""
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


@pytest.fixture(scope="session")
def sticking(cache):
    return MembranePlant(contact="stick")


@pytest.fixture(params=["one_sided", "two_sided", "with_limit_point"])
def plant(request):
    return request.getfixturevalue(request.param)
