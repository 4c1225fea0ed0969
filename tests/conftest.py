"""Settings of all tests."""

from hypothesis import settings

# The same examples in every run, so that a green run stays green; no deadline, as a first call compiles.
settings.register_profile("repeatable", derandomize=True, deadline=None)
settings.load_profile("repeatable")

# Files that take longest come first, so that no worker starts one of them when the others are done.
LONGEST = ("tests/pipeline/test_pipeline.py", "tests/guides", "tests/pipeline", "tests/diagnosis", "tests/inverse")


def pytest_collection_modifyitems(items):
    def place(item):
        path = item.path.relative_to(item.config.rootpath).as_posix()
        return next((k for k, long in enumerate(LONGEST) if path.startswith(long)), len(LONGEST))

    items.sort(key=place)
