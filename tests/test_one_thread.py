"""BLAS works with one thread as long as anyone asks for it, whoever comes and goes first."""

import threading

import pytest
from threadpoolctl import ThreadpoolController, threadpool_limits

from damagepred.one_thread import one_blas_thread


def threads() -> set[int]:
    return {library["num_threads"] for library in ThreadpoolController().select(user_api="blas").info()}


@pytest.fixture(autouse=True)
def _two_threads():
    import scipy.linalg  # noqa: F401

    with threadpool_limits(2, user_api="blas"):
        yield


def test_holds_until_the_last_has_gone():
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


def test_is_lifted_after_an_error():
    with pytest.raises(ValueError, match="gone"), one_blas_thread():
        raise ValueError("gone")
    assert threads() == {2}
