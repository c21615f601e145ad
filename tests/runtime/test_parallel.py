"""Threads over cores, without a matrix library's own threads on top."""

from __future__ import annotations

import threading
from concurrent.futures import ThreadPoolExecutor

from threadpoolctl import threadpool_info

from nacre.runtime.parallel import core_count, one_blas_thread, thread_map, thread_slices


def blas_threads() -> list[int]:
    return [x["num_threads"] for x in threadpool_info() if x["user_api"] == "blas"]


def test_thread_map_keeps_the_order():
    assert list(thread_map(lambda x: x * x, range(100))) == [x * x for x in range(100)]
    assert core_count() >= 1


def test_slices_keep_the_order_and_take_no_threads_beside_those_that_work(monkeypatch):
    monkeypatch.setattr("nacre.runtime.parallel.core_count", lambda: 3)
    found = thread_slices(lambda part: (part, threading.get_ident()), 10, 4)
    assert [part for part, _ in found] == [slice(0, 4), slice(4, 8), slice(8, 12)]
    assert threading.get_ident() not in {thread for _, thread in found}

    def within(_: int) -> set[int]:
        return {threading.get_ident(), *thread_slices(lambda _: threading.get_ident(), 10, 4)}

    assert [len(threads) for threads in thread_map(within, range(4))] == [1] * 4


def test_products_take_one_thread_inside_a_block_and_as_many_as_before_after_it():
    before = blas_threads()
    with one_blas_thread():
        inside = [*thread_map(lambda _: blas_threads(), range(8)), blas_threads()]
    assert all(set(counts) <= {1} for counts in inside)
    assert blas_threads() == before


def test_blocks_that_overlap_share_the_limit():
    before = blas_threads()
    first, second = one_blas_thread(), one_blas_thread()
    with first:
        second.__enter__()
    assert set(blas_threads()) <= {1}
    second.__exit__(None, None, None)
    assert blas_threads() == before


def test_blocks_limit_products_whatever_threads_they_begin_and_end_in():
    """A thread that lives on after its block keeps nobody else from the limit."""
    block = one_blas_thread()

    def inside() -> list[int]:
        with block:
            return blas_threads()

    with ThreadPoolExecutor(1) as one, ThreadPoolExecutor(1) as other:
        found = [one.submit(inside).result(), inside(), other.submit(inside).result()]
        one.submit(block.__enter__).result()
        block.__exit__(None, None, None)
        found += [inside(), one.submit(inside).result()]
    assert all(set(counts) <= {1} for counts in found)
