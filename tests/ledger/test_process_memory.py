import functools
import gc
import inspect
import pathlib
import unittest.mock

import derivations
import firstorder
from firstorder.ledger._process_memory import cached_functions, forget

HERE = pathlib.Path(__file__).parent
PACKAGES = [pathlib.Path(p.__file__).parent for p in (firstorder, derivations)]
MOCK = unittest.mock.call  # it is wrapped by a mock, which is wrapped by a mock


@functools.cache
def remembered():
    return []


@functools.wraps(remembered)
def wrapped():
    return remembered()


class Named:
    class Within:
        @staticmethod
        @functools.cache
        def of_class():
            return []

        @property
        @functools.cache  # noqa: B019
        def of_instance(self):
            return []


def name(function):
    return f"{function.__module__}.{function.__qualname__}"


def names(folders):
    return {name(f) for f in cached_functions(folders)}


def ours(function):
    code = getattr(inspect.unwrap(function), "__code__", None)
    return code and any(pathlib.Path(code.co_filename).is_relative_to(p) for p in PACKAGES)


def test_every_cached_function_among_all_objects_is_found():
    among_all = {name(f) for f in gc.get_objects() if type(f) is type(remembered) and ours(f)}
    assert len(among_all) > 15
    assert among_all <= names(PACKAGES)


def test_those_of_classes_and_under_other_decorators_are_found():
    found = {name.rpartition(".")[2] for name in names([HERE])}
    assert found >= {"remembered", "of_class", "of_instance"}


def test_a_folder_that_begins_with_the_same_letters_is_another():
    assert not names([HERE.with_name("led")])


def test_what_is_forgotten_is_computed_anew():
    before = remembered(), Named.Within.of_class(), Named().Within().of_instance
    assert wrapped() is before[0]
    forget([HERE])
    after = remembered(), Named.Within.of_class(), Named().Within().of_instance
    assert not any(a is b for a, b in zip(after, before, strict=True))
