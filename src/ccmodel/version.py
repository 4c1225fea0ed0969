"""Version of the installed package; that of sources that were never installed is unknown."""

from importlib.metadata import PackageNotFoundError, version

try:
    __version__ = version("ccmodel")
except PackageNotFoundError:
    __version__ = "0+unknown"
