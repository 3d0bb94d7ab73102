from mav_robot_status.mavlink.counters import MAX_IDS, OTHER_IDS, Counters, count


def test_counters_add_up() -> None:
    total = Counters(1, 2, 3, 4, 5, 6, {7: 8}, {9: 10})
    total.add(Counters(10, 20, 30, 40, 50, 60, {7: 80, 8: 1}, {}))
    assert total == Counters(11, 22, 33, 44, 55, 66, {7: 88, 8: 1}, {9: 10})


def test_a_full_table_counts_new_ids_under_one_key_and_known_ids_as_before() -> None:
    table = dict.fromkeys(range(MAX_IDS), 1)
    for message_id in (MAX_IDS, 5, MAX_IDS + 1):
        count(table, message_id)
    assert len(table) == MAX_IDS + 1
    assert (table[5], table[OTHER_IDS]) == (2, 2)
