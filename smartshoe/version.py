"""The version of this package, taken from the build's tag, for results that name the software that made them."""

try:
    from smartshoe._version import __version__
except ImportError:  # sources that were not installed
    __version__ = "0+unknown"

__all__ = ["__version__"]
