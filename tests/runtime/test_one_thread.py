"""BLAS works with one thread as long as anyone asks for it, whoever comes and goes first."""

import threading
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor

import pytest
from threadpoolctl import ThreadpoolController, threadpool_limits

from damagepred.runtime.one_thread import each_with_one_blas_thread, has_one_blas_thread, one_blas_thread


def threads() -> set[int]:
    return {library["num_threads"] for library in ThreadpoolController().select(user_api="blas").info()}


@pytest.fixture(autouse=True)
def _two_threads() -> Iterator[None]:
    import scipy.linalg  # noqa: F401

    with threadpool_limits(2, user_api="blas"):
        yield


def beside(work: Callable[[], object]) -> object:
    """Do work in another thread, and wait for it."""
    with ThreadPoolExecutor(1) as executor:
        return executor.submit(work).result(10)


def limited() -> set[int]:
    with one_blas_thread():
        return threads()


def test_holds_until_the_last_has_gone() -> None:
    inside, leave = threading.Event(), threading.Event()
    seen: list[set[int]] = []

    def other() -> None:
        with one_blas_thread():
            inside.set()
            leave.wait(10)
            seen.append(threads())

    thread = threading.Thread(target=other)
    with one_blas_thread():
        assert threads() == {1}
        thread.start()
        assert inside.wait(10)
    leave.set()
    thread.join(10)
    assert seen == [{1}]  # after the first has gone
    assert threads() == {2}  # and not one for ever: the second came when there was one


def test_is_lifted_after_an_error() -> None:
    with pytest.raises(ValueError, match="gone"), one_blas_thread():
        raise ValueError("gone")
    assert threads() == {2}


def test_holds_in_another_thread_than_the_one_that_set_threads_first() -> None:
    assert limited() == {1}
    assert beside(limited) == {1}  # though the first thread of the process still has a limit of its own
    assert threads() == {2}


def test_holds_again_within_where_others_have_set_threads() -> None:
    with one_blas_thread():
        beside(lambda: threadpool_limits(3, user_api="blas"))
        assert limited() == {1}
        assert threads() == {1}
    assert threads() == {2}


def test_a_generator_is_limited_while_it_computes() -> None:
    closed = []

    @each_with_one_blas_thread
    def values(count: int) -> Iterator[tuple[int, set[int]]]:
        try:
            for number in range(count):
                yield number, threads()
        finally:
            closed.append(count)

    assert list(values(2)) == [(0, {1}), (1, {1})]
    for _ in values(5):
        assert not has_one_blas_thread()
        assert threads() == {2}
        break
    assert closed == [2, 5]
