from __future__ import annotations

import threading
from functools import partial

import pytest

from mav_robot_status.gateway.events.worker import Worker

from ....deadline import wait_until


def settle(worker: Worker) -> None:
    def idle() -> bool:
        worker.finish()
        return not worker.busy

    wait_until(idle)


def test_a_job_runs_in_another_thread_and_its_result_arrives_in_this_one() -> None:
    worker = Worker("jobs")
    found: list[tuple[threading.Thread, threading.Thread]] = []
    assert not worker.busy
    worker.do(threading.current_thread, lambda thread: found.append((thread, threading.current_thread())))
    assert worker.busy
    settle(worker)
    ((there, here),) = found
    assert here is threading.current_thread()
    assert there is not here
    assert there.daemon


def test_a_worker_that_is_closed_has_done_its_jobs() -> None:
    worker = Worker("jobs")
    worker.close()
    found: list[int] = []
    worker.do(lambda: found.append(1), lambda _: None)
    worker.close()
    assert found == [1]


def test_results_arrive_in_the_order_of_the_jobs() -> None:
    worker = Worker("jobs")
    found: list[int] = []
    for number in range(100):
        worker.do(partial(int, number), found.append)
    settle(worker)
    assert found == list(range(100))


def test_a_job_that_raises_is_logged_and_the_next_one_runs(caplog: pytest.LogCaptureFixture) -> None:
    worker = Worker("jobs")
    found: list[int] = []
    worker.do(lambda: 1 // 0, found.append)
    worker.do(lambda: 2, found.append)
    settle(worker)
    assert found == [2]
    assert "ZeroDivisionError" in caplog.text
