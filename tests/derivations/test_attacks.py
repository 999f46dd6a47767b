"""Every row that names a function notices two faults in it, or says why not.

They are a tenth of a per cent too much and a tenth of a per cent too little.
"""

import collections

import pytest

from derivations import table
from derivations.unnoticed import UNNOTICED
from firstorder.ledger import NUMERIC, REQUIRED, Check, attack

GROUPS = collections.defaultdict(list)
for _, row in table().values():
    if row.implements and any(isinstance(getattr(row, route), Check) for route in NUMERIC):
        GROUPS[row.implements].append(row)


@pytest.mark.slow
@pytest.mark.parametrize("name", sorted(GROUPS))
def test_every_row_notices_that_what_it_names_is_too_much_and_too_little(name):
    found = attack(GROUPS[name], REQUIRED)
    assert [str(a) for a in found if not a.sound] == []


def test_a_row_is_excepted_only_from_an_attack_that_is_made():
    attacked = {row.equation for rows in GROUPS.values() for row in rows}
    assert set(UNNOTICED) - attacked == set()


def test_most_rows_name_what_they_judge():
    assert sum(map(len, GROUPS.values())) > 400
    assert len(UNNOTICED) <= 30
