import pytest
from virtual_runs import ROOT, plan_of, strung

from virtualrig.campaign import run
from virtualrig.config import Campaign, read_campaign


@pytest.fixture(scope="session")
def campaign() -> Campaign:
    """A rig without flaws."""
    return read_campaign(ROOT / "tests" / "data" / "ideal-rig" / "rig.yaml")


@pytest.fixture(scope="session")
def trajectory(campaign):
    """Call with (batch, recording) for the nominal trajectory over two cycles; each is simulated once."""
    made = {}

    def simulated(batch, recording):
        if (batch, recording) not in made:
            plan = plan_of(campaign, batch, recording, rest_s=0.02, cycles=1.5)
            made[batch, recording] = run(campaign, plan, strung(campaign, plan))
        return made[batch, recording]

    return simulated
