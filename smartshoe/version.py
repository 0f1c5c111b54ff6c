"""The version of this package, for results that name what made them: the build's, which has it from the tag."""

try:
    from smartshoe._version import __version__
except ImportError:  # sources that nobody installed
    __version__ = "0+unknown"

__all__ = ["__version__"]
