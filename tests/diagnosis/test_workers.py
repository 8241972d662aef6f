"""Claims about where fits run: the answer is the same everywhere, and nothing that was done is lost."""

from __future__ import annotations

import json

import pytest
from killed import always_die, die_once, square
from planted import small_data

from catheter_sim.diagnosis import workers as module
from catheter_sim.diagnosis.pipeline import diagnose_dataset
from catheter_sim.diagnosis.result import to_json
from catheter_sim.diagnosis.workers import HERE, Workers, each, workers
from catheter_sim.errors import InputError

NUMBERS = [(float(number),) for number in range(5)]
SQUARES = [0.0, 1.0, 4.0, 9.0, 16.0]


def test_results_come_in_order():
    """Here, and in two other processes."""
    for place in (HERE, Workers(2)):
        with workers(place) as pool:
            assert each(pool, square, NUMBERS) == SQUARES


def test_what_was_finished_is_not_done_again(tmp_path):
    """Three of five results are there: two calls are made, with the same answer."""
    marks, kept = tmp_path / "marks", tmp_path / "kept"
    marks.mkdir()
    place = Workers(kept=kept)
    asked = [(float(number), marks) for number in range(5)]
    assert each(place, square, asked[:3]) == SQUARES[:3]
    assert each(place, square, asked) == SQUARES
    assert len(list(marks.iterdir())) == 5


def test_another_question_does_not_find_it(tmp_path, monkeypatch):
    """Another function, another argument or another source of the package: another file."""
    place = Workers(kept=tmp_path)
    each(place, square, [(2.0,)])
    each(place, square, [(3.0,)])
    each(place, abs, [(2.0,)])
    assert len(list(tmp_path.iterdir())) == 3
    monkeypatch.setattr(module, "_source", lambda: "changed")
    each(place, square, [(2.0,)])
    assert len(list(tmp_path.iterdir())) == 4


def test_half_a_file_is_no_result(tmp_path):
    """What a run left that was killed while it wrote has another name and is not read."""
    place = Workers(kept=tmp_path)
    each(place, square, [(2.0,)])
    (whole,) = tmp_path.iterdir()
    whole.rename(tmp_path / f".{whole.stem}.abc.pickle")
    assert each(place, square, [(2.0,)]) == [4.0]


@pytest.mark.slow
def test_killed_process_is_replaced(tmp_path):
    """One process dies in the middle of a call: the results are as if nothing had happened."""
    with workers(Workers(2)) as pool:
        asked = [(float(number), tmp_path / "mark") for number in range(5)]
        assert each(pool, die_once, asked) == SQUARES
    assert (tmp_path / "mark").exists()


@pytest.mark.slow
def test_processes_that_always_die_get_one_line():
    """The line names the number of jobs."""
    with workers(Workers(2)) as pool, pytest.raises(InputError, match=r"--jobs 2: .* killed 3 times"):
        each(pool, always_die, NUMBERS)


@pytest.mark.slow
def test_no_scheduler_gets_one_line(monkeypatch):
    """Nobody listens at the address, or it is none."""
    monkeypatch.setattr(module, "_LONGEST_WAIT_S", 0.5)
    for address in ("tcp://127.0.0.1:9", "nonsense://x"):
        with pytest.raises(InputError, match="no scheduler answers"), workers(Workers(dask=address)):
            pass


@pytest.mark.slow
def test_a_cluster_that_loses_a_worker_gives_the_same_results(tmp_path):
    """Dask starts another one."""
    from distributed import LocalCluster

    asked = [(float(number), tmp_path / "mark") for number in range(5)]
    with (
        LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster,
        workers(Workers(dask=cluster.scheduler_address)) as pool,
    ):
        assert each(pool, die_once, asked) == SQUARES


@pytest.mark.slow
def test_diagnosis_does_not_depend_on_where_it_is_made(tmp_path):
    """Here, in two processes, on a cluster, and taken up again half-way: the same JSON."""
    from distributed import LocalCluster

    data = small_data({"backlash": {"width_mm": 0.4}})

    def found(place):
        return json.dumps(to_json(diagnose_dataset(data, place, simulation=False)))

    here = found(HERE)
    assert json.loads(here)["verdict"] == "cause_found"
    assert found(Workers(2, kept=tmp_path)) == here
    kept = sorted(tmp_path.iterdir(), key=lambda path: path.stat().st_mtime)
    for path in kept[len(kept) // 2 :]:
        path.unlink()
    assert found(Workers(1, kept=tmp_path)) == here
    with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster:
        assert found(Workers(dask=cluster.scheduler_address)) == here
