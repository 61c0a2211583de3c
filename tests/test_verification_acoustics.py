"""Every row that noise, motors and batteries add to the verification table holds."""

import pytest

from lpc_mdo.verification import battery, motor, noise


@pytest.mark.parametrize("module", [noise, motor, battery], ids=["noise", "motor", "battery"])
def test_every_comparison_is_within_its_tolerance(module):
    rows = module.comparisons()
    assert len(rows) >= 3
    for row in rows:
        assert row.is_met, row
        assert row.reason
        assert row.against
